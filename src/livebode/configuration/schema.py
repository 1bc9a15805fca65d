"""JSON Schema of axis.toml, for editors: what the models accept, in draft 2020-12."""

from __future__ import annotations

from math import isfinite
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema

from livebode.configuration.axes import AXES_MAX, NAME, SUCCESSOR
from livebode.configuration.axis import Axis
from livebode.configuration.descriptions import descriptions, summary
from livebode.core import TypedTable
from livebode.language import available
from livebode.plugins import named
from livebode.sources.live import EVERY, LOG

Schema = dict[str, Any]


class TomlSchema(GenerateJsonSchema):
    """Schemas of tables: no null, because TOML has none; descriptions from the docstrings of the models."""

    def nullable_schema(self, schema: Any) -> Schema:
        """The schema of the value; null is the omitted key."""
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: Any) -> Schema:
        """With its default, if JSON can express it; that of a table is in the table's keys."""
        default = self.get_default_value(schema)
        if (
            default is None
            or isinstance(default, BaseModel | TypedTable)
            or (isinstance(default, float) and not isfinite(default))
        ):
            return self.generate_inner(schema["schema"])
        return super().default_schema(schema)

    def tuple_schema(self, schema: Any) -> Schema:
        """A list of fixed length; the items of each are alike, which also older drafts can express."""
        items = [self.generate_inner(item) for item in schema["items_schema"]]
        assert all(item == items[0] for item in items)
        return {"type": "array", "items": items[0], "minItems": len(items), "maxItems": len(items)}

    def field_title_should_be_set(self, schema: Any) -> bool:  # noqa: ARG002 - for every field
        """No title: it would only repeat the key."""
        return False

    def model_schema(self, schema: Any) -> Schema:
        """With the description of each key, and without the name of the class."""
        kind, found = schema["cls"], super().model_schema(schema)
        found.pop("title", None)
        for name, text in descriptions(kind).items():
            found["properties"][name]["description"] = text
        return found | {"description": summary(kind)} | _EXTRA.get(kind.__name__, dict)()


def schema_of(model: type[BaseModel], file: str) -> Schema:
    """Schema of a file; the id is a name, not an address from which the schema could be read."""
    found = model.model_json_schema(schema_generator=TomlSchema)
    head = {"$schema": TomlSchema.schema_dialect, "$id": f"urn:livebode:schema:{file}", "title": f"{file}.toml"}
    return head | found


def axis_schema() -> Schema:
    """Schema of axis.toml, with one axis or with several in [axes]."""
    found = schema_of(Axis, "axis")
    found["$defs"]["FitSection"]["properties"]["model"]["enum"] = ["auto", *named("models")]
    found["$defs"]["PublishSection"]["properties"]["kind"]["enum"] = [*named("sinks")]
    for section in ("ServeSection", "ReportSection"):
        found["$defs"][section]["properties"]["language"]["enum"] = [*available()]
    required = _required(found, found["$defs"])
    # A key that an axis needs may be in a common section, or in the axis's own.
    for table in (found, *found["$defs"].values()):
        table.pop("required", None)
    found["$defs"]["LimitSection"]["required"] = ["quantity"]
    found["$defs"]["PublishSection"]["required"] = ["kind"]
    found["$defs"]["ControllerSection"]["required"] = ["output", "input"]
    found["$defs"]["Axis"] = {key: found[key] for key in ("type", "additionalProperties", "description", "properties")}
    axes = {
        "description": "Several axes by name; the sections outside [axes] apply to all of them.",
        "type": "object",
        "minProperties": 1,
        "maxProperties": AXES_MAX,
        "propertyNames": {"pattern": f"^{NAME.pattern}$", "not": {"pattern": f"^{SUCCESSOR.pattern}$"}},
        "additionalProperties": {"$ref": "#/$defs/Axis"},
    }
    required["properties"]["source"] = {"anyOf": [{"required": [key]} for key in ("log", "url", "replay")]}
    return found | {
        "properties": found["properties"] | {"axes": axes},
        "if": {"required": ["axes"]},
        "else": required,
    }


def _required(schema: Schema, tables: Schema) -> Schema:
    """Only the required keys of a table and of the tables in it."""
    if "$ref" in schema:
        return _required(tables[schema["$ref"].rpartition("/")[2]], tables)
    inner = {name: _required(value, tables) for name, value in schema.get("properties", {}).items()}
    inner = {name: value for name, value in inner.items() if value}
    own = {"required": schema["required"]} if "required" in schema else {}
    return own | ({"properties": inner} if inner else {})


def _source() -> Schema:
    """Which keys of [source] can be combined: a kind of live source has its own."""
    kinds = [
        {
            "if": {"required": ["url"], "properties": {"url": {"pattern": f"^{scheme.replace('.', '[.]')}:"}}},
            "then": {"propertyNames": {"enum": sorted(kind.keys | EVERY | {"url"})}},
        }
        for scheme, kind in named("sources").items()
    ]
    growing = {
        "if": {"required": ["follow", "log"], "properties": {"follow": {"const": True}}},
        "then": {"propertyNames": {"enum": sorted(LOG | EVERY)}},
    }
    replaying = {
        "if": {"required": ["replay"]},
        "then": {"propertyNames": {"enum": sorted(EVERY | {"replay"})}},
    }
    return {"not": {"required": ["log", "url"]}, "allOf": [*kinds, growing, replaying]}


_EXTRA = {"SourceSettings": _source}
