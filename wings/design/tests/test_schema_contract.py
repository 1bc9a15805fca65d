"""The schema of experiment.toml and what reads the file accept and refuse the same values of a key."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from livebode.configuration import kind_of_file
from livebode.core import ConfigError, LivebodeError
from livebode_design import Experiment, MachineLimits
from livebode_design.experiment import BELT, made_of
from livebode_design.experiment_schema import experiment_schema
from livebode_design.file_kinds import FILES
from livebode_design.matrix.matrix_experiment import TABLES as MACHINES
from tests.support.schemas import tables, validator, values_of, with_value

ROOT = Path(__file__).parents[3]
SCHEMA = experiment_schema()
VALID = validator(SCHEMA)
TABLES = dict(tables(SCHEMA))
CONTROLLERS = {
    "velocity": {"gain": 1.0, "rate_hz": 4000},
    "position": {"gain": 1.0, "rate_hz": 4000},
    "position_pd": {"position_gain": 1.0, "velocity_gain": 1.0, "rate_hz": 4000},
}
EXCITATION = {"band_hz": [20, 140], "resolution_hz": 10}
NEEDED: dict[str, dict[str, Any]] = {
    "order": {"band_hz": [20, 140], "kind": "prbs"},
    "rate_divider": EXCITATION | {"kind": "prbs"},
    "window": {"band_hz": [20, 140]},
    "lines": {"window": 400},
    "sweep": EXCITATION | {"kind": "chirp"},
    "periods": EXCITATION | {"kind": "stepped"},
}
"""What a key of [excitation] needs."""


RELATIONS = {"usage.conflict", "simulation.parameters-impossible"}


def error_of(data: dict[str, Any]) -> LivebodeError | None:
    """Why a table cannot be read."""
    try:
        found = Experiment.of(data, "experiment.toml")
        found.spec()
        made_of(MachineLimits, found.limits, "limits")
        if found.belt is not None:
            found.signal_names()
        for name, table in (found.belt or {}).items():
            made_of(BELT[name], table, name)
    except LivebodeError as error:
        return error
    return None


def base_of(table: tuple[str, ...], name: str) -> dict[str, Any]:
    measured = {"measured", "loop"} & {*table[:1], name}
    machine: dict[str, Any] = {"measured": {"run": "run"}} if measured else {"belt": {}}
    if table[:1] == ("loop",) and len(table) == 2:
        machine["loop"] = {table[1]: CONTROLLERS[table[1]]}
    return {"excitation": NEEDED.get(name, EXCITATION)} | machine


@pytest.mark.parametrize("table", TABLES, ids=".".join)
def test_every_key_has_a_description(table: tuple[str, ...]) -> None:
    for name, key in TABLES[table]["properties"].items():
        assert re.fullmatch(r"\S.*\.", key["description"]), name


@pytest.mark.parametrize("table", TABLES, ids=".".join)
def test_a_value_is_valid_where_livebode_accepts_it(table: tuple[str, ...]) -> None:
    """Every type, every choice, and the values at and just outside the limits."""
    for name, key in TABLES[table]["properties"].items():
        for value in values_of(key):
            data = with_value(base_of(table, name), (*table, name), value)
            valid, error = VALID.is_valid(data), error_of(data)
            # A value that contradicts another key: livebode alone finds this.
            related = error is not None and (error.code in RELATIONS or error.facts.get("argument", name) != name)
            assert valid == (error is None) or (valid and related), (table, name, value, error)
    unknown = with_value(base_of(table, ""), (*table, "unknown"), 1)
    assert not VALID.is_valid(unknown)
    assert error_of(unknown) is not None


@pytest.mark.parametrize(
    "data",
    [
        {"belt": {}},
        {"excitation": EXCITATION},
        {"excitation": EXCITATION, "belt": {}, "measured": {"run": "run"}},
        {"excitation": EXCITATION, "belt": {}, "loop": {}},
        {"excitation": EXCITATION, "measured": {}},
        {"excitation": EXCITATION | {"periods": 4}, "belt": {}},
        {"excitation": EXCITATION | {"kind": "prbs", "sweep": "linear"}, "belt": {}},
    ],
)
def test_what_is_missing_or_contradicts_another_key_is_refused_by_both(data: dict[str, Any]) -> None:
    assert error_of(data) is not None
    assert not VALID.is_valid(data)


def test_a_belt_has_one_motion() -> None:
    data = {"excitation": EXCITATION, "belt": {"strokes": {}, "standstill": {}}}
    with pytest.raises(ConfigError, match="exclude each other"):
        Experiment.of(data, "experiment.toml").axis()
    assert not VALID.is_valid(data)


def test_the_example_is_valid() -> None:
    VALID.validate(tomllib.loads((ROOT / "examples" / "experiment.toml").read_text("utf-8")))


def test_a_file_is_recognised_by_the_table_of_its_machine() -> None:
    assert FILES["matrix-experiment"].tables == set(MACHINES)
    assert all(kind_of_file({"excitation": {}, name: {}}) == FILES["matrix-experiment"] for name in MACHINES)
    assert kind_of_file({"excitation": {}, "belt": {}}) == FILES["experiment"]
    assert kind_of_file({"source": {}, "signals": {}}) is None
