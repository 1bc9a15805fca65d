"""A lake with a year of an axis, as `livebode fleet sink` stores it: means of each hour, and a stiffness that falls."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pyarrow as pa

from livebode.core import LEVELS
from livebode_plant.lake import TABLES, Lake, StreamTable

LOST_A_MONTH = 0.004
"""Share of the stiffness."""


def write_year(place: Path, path: str, stiffness: float, *, days: int = 365, tier: str = "hour") -> None:
    """Store an axis with all four levels in its path, until now.

    Parameters
    ----------
    place
        Directory of the lake.
    path
        Of the axis.
    stiffness
        At the end, N/m.
    days
        How long; without each seventh day, and a standstill of two weeks.
    tier
        Which means.
    """
    now, rng = datetime.now(UTC).replace(minute=0, second=0, microsecond=0), np.random.default_rng(7)
    hours = [now - timedelta(hours=hour) for hour in range(24 * days, 0, -1)]
    working = [at for at in hours if (now - at).days % 7 != 6 and not 150 < (now - at).days < 164]
    month = np.array([(now - at).total_seconds() for at in working]) / (365.25 / 12 * 86400)
    day = rng.normal(0, 0.002, days + 2)[np.array([(now - at).days for at in working], np.intp)]
    level = stiffness * (1 + LOST_A_MONTH * month + day + rng.normal(0, 0.0015, len(month)))
    resonance = 41.3 * np.sqrt(level / stiffness)
    columns = [("stiffness", "N/m", level, 0.003), ("resonance", "Hz", resonance, 0.0015)]
    parts = [_rows(path, working, *one) for one in columns]
    StreamTable(Lake(str(place)), f"fleet_parameters_{tier}").append(path, 1, lambda _: pa.concat_tables(parts))


def _rows(path: str, hours: list[datetime], name: str, unit: str, value: np.ndarray, bound: float) -> pa.Table:
    about = dict(zip(LEVELS, path.split("/"))) | {"log": "2026", "run": 1, "recipe": "a" * 16, "fits": 7200}
    about |= {"model": "two-mass", "name": name, "unit": unit}
    rows = [
        about
        | {"day": at.date(), "logged_from": at, "value": one, "bound_95": one * bound}
        | {"low": one * (1 - 2 * bound), "high": one * (1 + 2 * bound)}
        for at, one in zip(hours, value.tolist())
    ]
    return pa.Table.from_pylist(rows, TABLES["fleet_parameters_hour"].schema)
