"""The schema of experiment.toml and what reads the file accept and refuse the same values of a key."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from livebode.core import LivebodeError
from livebode.experiment_design import MachineLimits
from livebode.experiments.experiment import BELT, Experiment, made_of
from livebode.experiments.experiment_schema import experiment_schema
from tests.support.schemas import tables, validator, values_of, with_value

ROOT = Path(__file__).parents[2]
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
    "held_ticks": EXCITATION | {"kind": "prbs"},
    "window": {"band_hz": [20, 140]},
    "lines": {"window": 400},
    "sweep": EXCITATION | {"kind": "chirp"},
    "periods": EXCITATION | {"kind": "stepped"},
}
"""What a key of [excitation] needs."""


def accepted(data: dict[str, Any]) -> bool:
    """Whether every table can be read; a conflict of several keys of [belt] is not one of a value."""
    try:
        found = Experiment.of(data, "experiment.toml")
        found.spec()
        made_of(MachineLimits, found.limits, "limits")
        if found.belt is not None:
            found.signal_names()
        for name, table in (found.belt or {}).items():
            made_of(BELT[name], table, name)
    except LivebodeError as error:
        others = error.facts.keys() & {"rate_hz", "position_m_max", "parameter"} or error.facts.get("low") == 0 and error.facts.get("high")
        return bool(others) and str(error.facts.get("argument", "")).endswith(("_m", "_m_min", "_hz")) or error.code == "simulation.parameters-impossible"
    return True


def base_of(table: tuple[str, ...], name: str) -> dict[str, Any]:
    machine: dict[str, Any] = {"measured": {"run": "run"}} if table[:1] in (("measured",), ("loop",)) or name in ("measured", "loop") else {"belt": {}}
    if table[:1] == ("loop",) and len(table) == 2:
        machine["loop"] = {table[1]: CONTROLLERS[table[1]]}
    return {"excitation": NEEDED.get(name, EXCITATION)} | machine


