"""Options from the keys of sections: what is read as text is what pydantic reads; a command receives what is set."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

from livebode.cli.section_options import _SECTIONS, _keys, key_help, with_keys
from livebode.configuration import axis_schema
from livebode.plugins import loaded
from tests.support.command import livebode, signals, write_csv

PLAIN = {int: "integer", float: "number", bool: "boolean"}


def schema_of(section: str) -> dict[str, Any]:
    """The section in the schema that editors use, with the types of its keys."""
    whole = axis_schema()
    table = whole["properties"][section]
    return whole["$defs"][table["$ref"].rpartition("/")[2]] if "$ref" in table else table


@pytest.mark.parametrize("section", _SECTIONS)
def test_the_keys_of_a_section_have_the_defaults_types_and_limits_of_its_model(section: str) -> None:
    kind: type[BaseModel] = loaded(_SECTIONS[section])
    fields = {field.alias or name: field for name, field in kind.model_fields.items()}
    read = _keys(section)
    assert read.keys() == fields.keys()
    for name, key in read.items():
        assert key.default == (None if fields[name].is_required() else fields[name].default)
        schema = schema_of(section)["properties"][name]
        own = [schema, *schema.get("anyOf", [])]
        if key.type in PLAIN:
            assert PLAIN[key.type] in [one.get("type") for one in own], name
        if (least := next((one["exclusiveMinimum"] for one in own if "exclusiveMinimum" in one), None)) is not None:
            assert f"x>{least}" in key.help, name
        if key.type is Path:
            assert "path" in [one.get("format") for one in own], name


def test_the_help_is_the_description_with_default_and_limits() -> None:
    assert key_help("tracking.forgetting") == (
        "Weight of a period relative to the next one; 1 forgets nothing. "
        "\\[default: 0.8; 1 for the average of a recording; x>0; x<=1]"
    )
    assert key_help("source.dbc") == "DBC file that defines the signals of CAN frames, live or in a recording."
    assert key_help("tracking.spikes").endswith("windows with a spike are excluded; repeat for several.")
    assert "use the controllers in \\[loop]; without them" in key_help("tracking.quantity")


def test_a_command_receives_the_keys_that_were_specified_and_no_others() -> None:
    received: list[Any] = []

    @with_keys(tracking={"hop": ("--hop", "SAMPLES"), "hann": ("--hann", "")}, source={"from": ("--from", "MOMENT")})
    def command(log: str, *, sections: dict[str, dict[str, Any]], force: bool = False) -> None:
        received.append((log, sections, force))

    command(log="a", hop=20, hann=False, from_=None, force=True)
    command(log="b", hop=None, hann=None, from_="3", force=False)
    assert received == [("a", {"tracking": {"hop": 20, "hann": False}}, True), ("b", {"source": {"from": "3"}}, False)]


def test_an_option_can_take_back_what_the_configuration_sets(tmp_path: Path) -> None:
    log = write_csv(tmp_path / "log.csv", signals())
    given = f'[source]\nlog = "{log.name}"\n[signals]\nexcitation = "w"\ninput = "u"\noutput = "y"\n'
    (tmp_path / "axis.toml").write_text(f"{given}[tracking]\naccept_roles = true\nall_periods = true\n")
    done = livebode("run", tmp_path / "axis.toml", "--no-accept-roles", "--out", tmp_path / "run")
    assert done.code == 0, done.err
    recorded = json.loads((tmp_path / "run/run.json").read_text("utf-8"))["configuration"]["tracking"]
    assert (recorded["accept_roles"], recorded["all_periods"]) == (False, True)
