"""Lakes of simulated halls."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from typing import Any

import pyarrow as pa

from livebode_plant.lake import TABLES, Lake
from livebode_plant.trending.machine_year import MachineYear


def hall(path: Path, machines: Mapping[str, MachineYear], **columns: Any) -> Lake:
    """A lake with these machines, by site/line/machine/axis, each with the quantity Keff in percent."""
    lake = Lake(str(path))
    for number, (machine, year) in enumerate(machines.items()):
        add(lake, machine, year, number, **columns)
    return lake


def add(lake: Lake, machine: str, year: MachineYear, seed: int, **columns: Any) -> None:
    """Add the runs of a machine; `columns` replace those of its rows."""
    quantities = rows(machine, year, seed) if not columns else [row | columns for row in rows(machine, year, seed)]
    lake.add_rows("quantities", pa.Table.from_pylist(quantities, TABLES["quantities"].schema))
    lake.add_rows("runs", pa.Table.from_pylist([own(row) for row in quantities], TABLES["runs"].schema))


def rows(machine: str, year: MachineYear, seed: int) -> list[dict[str, Any]]:
    """The rows of the table of quantities."""
    time_s, value, bound, covariates = year.measured(seed)
    levels = dict(zip(("site", "line", "machine", "axis"), machine.split("/"))) if machine else {}
    return [
        levels
        | {"content": sha256(f"{machine} {seed} {i}".encode()).hexdigest(), "recipe": "a" * 16}
        | {"recorded_from": datetime.fromtimestamp(time_s[i], UTC), "model": "two-mass", "name": "Keff", "unit": "N/m"}
        | {"value": value[i], "bound_95": bound[i], "low": value[i], "high": value[i], "time_s": 4.0, "fits": 60}
        | {"covariates": [(name, x[i]) for name, x in covariates.items()]}
        for i in range(len(value))
    ]


def own(row: dict[str, Any]) -> dict[str, Any]:
    """The columns that a row has in common with the table of runs."""
    return {name: value for name, value in row.items() if name in TABLES["runs"].schema.names and name != "unit"}
