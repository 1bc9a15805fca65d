"""`python -m tools.configuration > docs/reference/configuration.md`: the keys of the files, from their schemas."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Iterator
from typing import Any

from livebode.configuration import axis_schema
from livebode_design.experiment_schema import experiment_schema, matrix_experiment_schema
from livebode_plant.archive.archive_settings import archive_schema

HEAD = """# Configuration

Three files configure livebode: `axis.toml` for `livebode run` and the other commands on an axis, `experiment.toml` for
`livebode design`, and `archive.toml` for `livebode archive`. All keys are checked before anything starts. If a value is
not possible, the message gives the key, the value and the remedy. Options of the command line override the file.

A minimal `axis.toml`:

```toml
[source]
log = "log.parquet"

[signals]
output = "y"
input = "u"
excitation = "w"
```

With `[axes.NAME]` tables one file describes several machines, and it may be edited while they run ([live
sources](../how-to/live.md)).

An editor can complete and check both files: [Completion in an editor](../how-to/editor.md).

Limits: a file has at most 1 MiB. A text in it has at most 500 characters (`frequencies` 20,000), all printable. Tables
and lists are nested at most 12 deep. Secrets are not allowed: a url with a user or password is rejected, and a message
never repeats the rejected value of `url`, `username`, or a password or token key.
"""
Schema = dict[str, Any]
MORE = {
    "source": "`log` or `url` is required. [Live sources](../how-to/live.md) lists the keys of each kind of `url`. "
    "The conventions describe [`clock`](conventions.md#time) and [`kinds`](conventions.md#kinds-of-quantities).",
    "tracking": "[Estimators](../explanation/estimators.md) describes the estimators, the bounds, the check of the "
    "roles and transients; [torque ripple](../explanation/motion.md#torque-ripple) describes `ripple`.",
    "loop": "[The loop description](../how-to/loop.md) gives the formulas.",
    "experiments": "See [several inputs and outputs](../how-to/matrix.md).",
    "record": "See [the run directory](run-directory.md).",
    "motion": "See [motion correction](../explanation/motion.md).",
    "machine": "The names form a path, such as `Graz/line 2/press 4/X`, which is the machine in the [list of runs and "
    "the trends](../how-to/runs.md) and in a report without `report.machine`. A name has no `/`.",
    "report": "See [reports](../../wings/reports/docs/report.md).",
    "fit": "See [fits](../explanation/fits.md).",
    "monitoring": "See [monitoring](../how-to/monitoring.md).",
    "serve": "See [the dashboard](../how-to/dashboard.md).",
    "[publish]": "[Connections](../how-to/connect/index.md) has a page for each kind.",
    "belt": "See [the simulated axis](axis.md).",
    "measured": "A limit on a quantity whose extremes are not known is rejected.",
    "drives": "See [several motors](../../wings/design/docs/excitation.md#several-motors).",
    "cluster": "See [archives](../../wings/plant/docs/archive.md).",
    "measure": "See [measuring](../../wings/design/docs/measure.md).",
    "excitation": "See [excitation design](../../wings/design/docs/excitation.md).",
}
"""Text below the heading of a table."""
LOOP = """As in axis.toml; by default the loop of the run. `[loop.velocity]` belongs to an output that is a velocity,
`[loop.position_pd]` to a position. The excitation is added at the plant input. It is not checked whether a loop other
than the run's is stable.
"""
SEVERAL = "experiment.toml of several motors"
SOURCE = """As in axis.toml: a live source, whose controller plays the excitation and sends the samples.
"""

_FILES = (
    ("axis.toml", axis_schema()),
    ("experiment.toml", experiment_schema()),
    (SEVERAL, matrix_experiment_schema()),
    ("archive.toml", archive_schema()),
)


def page() -> str:
    """The page in Markdown."""
    parts = [HEAD]
    for name, schema in _FILES:
        parts += [f"## {name}\n", *_tables(schema, "", schema, schema.get("else", {}))]
    return "\n".join(parts)


def _tables(file: Schema, name: str, table: Schema, needed: Schema) -> Iterator[str]:
    """A table and those in it; `needed` has the required keys if the table itself does not list them."""
    required = table.get("required", []) + needed.get("required", [])
    keys = {key: _resolved(file, value) for key, value in table["properties"].items() if key != "axes"}
    if name:
        # A heading occurs once on the page.
        whose = " of several motors" if file["title"] == "matrix-experiment.toml" else ""
        yield f"### [{name}]{whose}\n"
        about = table["description"].removeprefix(f"[{name}]: ")
        yield textwrap.fill(f"{about[0].upper()}{about[1:]} {MORE.get(name, '')}", 120, break_on_hyphens=False) + "\n"
    rows = [_row(key, value, key in required) for key, value in keys.items() if "properties" not in value]
    if rows:
        yield "\n".join(["| key | type | default | limits | description |", "|---|---|---|---|---|", *rows]) + "\n"
    for key, value in keys.items():
        if key == "loop" and file["title"] != "axis.toml":
            yield f"### [loop] of a measured axis\n\n{LOOP}"
        elif key == "source" and file["title"] != "axis.toml":
            yield f"### [source] of a measurement\n\n{SOURCE}"
        elif "$ref" in value.get("items", {}):
            yield from _tables(file, f"[{name}.{key}]" if name else f"[{key}]", _resolved(file, value["items"]), {})
        elif "properties" in value:
            yield from _tables(
                file, f"{name.strip('[]')}.{key}" if name else key, value, needed.get("properties", {}).get(key, {})
            )


def _resolved(file: Schema, value: Schema) -> dict[str, Any]:
    reference = value.get("$ref", "").rpartition("/")[2]
    return file["$defs"][reference] if reference else value


def _row(key: str, value: Schema, required: bool) -> str:
    default = "required" if required else ""
    if "default" in value:
        default = f"`{json.dumps(value['default'], ensure_ascii=False)}`"
    # As code, because a page has other quotation marks than TOML.
    about = re.sub(r'"[^"]+"', r"`\g<0>`", value["description"])
    cells = (f"`{key}`", _type(value), default, _limits(value), about)
    return f"| {' | '.join(map(_cell, cells))} |"


def _type(value: Schema) -> str:
    """The type in words, or the choices."""
    if "anyOf" in value:
        return " or ".join(map(_type, value["anyOf"]))
    choices = value.get("enum", [value["const"]] if "const" in value else [])
    if choices:
        return ", ".join(f"`{json.dumps(choice)}`" for choice in choices)
    if "$ref" in value:
        return "table"
    if value["type"] == "array":
        return f"list ({_type(value['items'])})"
    if value["type"] == "object":
        return f"table ({_type(value['additionalProperties'])})"
    return {"string": "text", "boolean": "true or false", "integer": "whole number"}.get(value["type"], value["type"])


def _limits(value: Schema) -> str:
    """Limits in words; those of the items of a list count for each."""
    own = {**value.get("items", {}), **value}
    if "anyOf" in own:
        return "; ".join(filter(None, map(_limits, own["anyOf"])))
    words = (("minimum", "≥ {:g}"), ("exclusiveMinimum", "> 0" if own.get("exclusiveMinimum") == 0 else "> {:g}"),
             ("maximum", "≤ {:g}"), ("exclusiveMaximum", "< {:g}"))  # fmt: skip
    found = [_number(text, own[name]) for name, text in words if name in own]
    low, high = own.get("minItems"), own.get("maxItems")
    if low is not None and low == high:
        found.append(f"{low} items")
    elif low or high:
        found.append(f"{low} or more items" if low else f"at most {high} items")
    return ", ".join(found)


def _number(text: str, limit: float) -> str:
    return text.replace("{:g}", f"{limit:,}" if isinstance(limit, int) else f"{limit:g}")


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


if __name__ == "__main__":
    print(page(), end="")
