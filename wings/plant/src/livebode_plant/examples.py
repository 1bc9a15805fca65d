"""The examples of an archive, and of a hall: a simulated year of seven axes, as the archive of a hall has it.

Only the results are simulated, not the recordings. The same rows on every call.
"""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from livebode.core import LEVELS, needing
from livebode.dataclass import dataclass
from livebode.interface import EXAMPLES, Example
from livebode.version import __version__

_BEGIN = datetime(2025, 1, 2, 6, tzinfo=UTC)
_DAYS, _MONTH_DAYS = 362, 365.25 / 12
_RECIPE = sha256(b"recipe").hexdigest()[:16]
_MEAN_C, _SWING_C = 22.0, 8.0
_GROUP = 200  # rows of a commit, as a coordinator writes them


@dataclass(frozen=True)
class _Quantity:
    model: str
    name: str
    unit: str
    level: float
    scatter: float
    per_kelvin: float
    bound: float


@dataclass(frozen=True)
class _Axis:
    """Faults are in percent of the stiffness: a jump, and a change per month from a month on."""

    path: str
    runs: int = 160
    until_month: float = 12.0
    jump: float = 0.0
    per_month: float = 0.0
    since_month: float = 0.0

    def stiffness(self, month: np.ndarray) -> np.ndarray:
        """Share that is left."""
        after = np.maximum(month - self.since_month, 0.0)
        return np.asarray(1 + (self.per_month * after + self.jump * (after > 0)) / 100)


_QUANTITIES = (
    _Quantity("two-mass", "Keff", "N/m", 5.2e5, 0.003, -0.001, 0.002),
    _Quantity("two-mass", "mL", "kg", 6.7, 0.002, 0.0, 0.002),
    _Quantity("two-mass", "bs", "N s/m", 130.0, 0.02, 0.004, 0.02),
    _Quantity("margins", "gain_margin", "dB", 9.4, 0.01, 0.0, 0.01),
)
_AXES = (
    _Axis("A/L1/M1/x"),
    _Axis("A/L1/M2/x", jump=-6.0, since_month=5.4),
    _Axis("A/L1/M3/x", per_month=-0.8, since_month=2.4),
    _Axis("A/L1/M4/x", per_month=-0.1),
    _Axis("A/L2/M1/x", until_month=7.3, runs=100),
    _Axis("A/L2/M2/x"),
    _Axis("A/L2/M2/y"),
    _Axis("A/L2/M3/x", runs=9),
)


def write_hall(path: Path) -> None:
    """Write the lake to a directory that does not exist.

    Raises
    ------
    ExtraError
        If PyArrow or deltalake is not installed.
    """
    with needing("PyArrow", "archive", "a lake"):
        import pyarrow as pa
    from livebode_plant.lake import TABLES, Lake

    lake = Lake(str(path))
    results = [result for number, axis in enumerate(_AXES) for result in _results(axis, number)]
    tables = {"quantities": [row for rows, _ in results for row in rows], "runs": [run for _, run in results]}
    for name, rows in tables.items():
        for begin in range(0, len(rows), _GROUP * 4):
            lake.add_rows(name, pa.Table.from_pylist(rows[begin : begin + _GROUP * 4], TABLES[name].schema))
    lake.add_rows("quarantine", pa.Table.from_pylist([_bad("A/L2/M3/x")], TABLES["quarantine"].schema))


PLANT_EXAMPLES = {
    "archive": Example(
        "three recordings as an archive, one of which is of another kind",
        {**EXAMPLES["standstill"].recordings, **EXAMPLES["chirp"].recordings},
        ("archive.toml", "archive-recipe.toml"),
        (
            "livebode archive run archive.toml",
            "livebode archive list archive.toml",
            "livebode archive list archive.toml --quarantined",
        ),
        package="livebode_plant",
    ),
    "hall": Example(
        "a year of a hall with eight axes, as the lake of an archive",
        {},
        (),
        ("livebode archive trend hall Keff", "livebode archive trend hall"),
        {"hall": write_hall},
    ),
}
"""The examples by name."""


def _results(axis: _Axis, number: int) -> Iterator[tuple[list[dict[str, Any]], dict[str, Any]]]:
    """Rows of `quantities`, and the row of `runs`, of each run."""
    random = np.random.default_rng([2026, number])
    days = np.sort(random.uniform(0, min(_DAYS, axis.until_month * _MONTH_DAYS), axis.runs))
    month = days / _MONTH_DAYS
    kelvin = -_SWING_C * np.cos(2 * np.pi * days / 365.25) + 2 * random.standard_normal(axis.runs)
    measured = {of: _values(of, axis, month, kelvin, random) for of in _QUANTITIES}
    for i, day in enumerate(days):
        own = _own(axis.path, f"{axis.path} {i}", _BEGIN + timedelta(seconds=round(day * 86400)))
        yield (
            [
                own
                | {"model": of.model, "name": of.name, "unit": of.unit, "value": float(values[i])}
                | {"bound_95": of.level * of.bound, "low": float(values[i]) * 0.99, "high": float(values[i]) * 1.01}
                | {"time_s": 4.0, "fits": 60, "covariates": [("temperature", float(_MEAN_C + kelvin[i]))]}
                for of, values in measured.items()
            ],
            own
            | {"url": f"s3://plant/{axis.path}/{i:04d}.parquet", "clock": "file", "duration_s": 8.0}
            | {"recorded_to": own["recorded_from"] + timedelta(seconds=8), "rate_hz": 4000.0, "window": 400}
            | {"quantity": "plant", "unit": "", "frequencies_hz": [20.0, 40.0, 60.0, 80.0, 100.0, 120.0, 140.0]}
            | {"responses": 320, "parameters": 240, "events": 0, "livebode": __version__},
        )


def _values(
    of: _Quantity, axis: _Axis, month: np.ndarray, kelvin: np.ndarray, random: np.random.Generator
) -> np.ndarray:
    share = 1 + of.per_kelvin * kelvin + of.scatter * random.standard_normal(len(month))
    share[random.random(len(month)) < 0.02] += 20 * of.scatter
    if of.name == "Keff":
        share *= axis.stiffness(month)
    elif of.name == "gain_margin":
        share += 0.3 * (axis.stiffness(month) - 1)
    return np.asarray(of.level * share)


def _own(path: str, content: str, recorded: datetime) -> dict[str, Any]:
    names: dict[str, str] = dict(zip(LEVELS, path.split("/")))
    key = {"content": sha256(content.encode()).hexdigest(), "recipe": _RECIPE}
    return {**key, **names, "recorded_from": recorded}


def _bad(path: str) -> dict[str, Any]:
    own = _own(path, "damaged", _BEGIN)
    del own["recorded_from"]
    return own | {
        "url": f"s3://plant/{path}/0009.parquet",
        "code": "recording.damaged",
        "sentence": "the file ends in the middle of a row group; copy it again",
        "livebode": __version__,
    }
