"""Contents of a lake: runs by machine, their alarms, and the recordings in quarantine."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from datetime import datetime
from typing import Any

import pyarrow.compute as pc
from packaging.version import Version

from livebode.core import LEVELS
from livebode.dataclass import dataclass
from livebode.language import recorded
from livebode_plant.lake import Lake, LakeRun
from livebode_plant.report.hall_report import RunAlarm
from livebode_plant.trending import Selection
from livebode_plant.trending.quantity_history import UNNAMED, where_of

_COLUMNS = ["content", "recipe", *LEVELS, "recorded_from", "alarms", "baseline"]


@dataclass
class MachineRuns:
    """The runs of a machine: how many, and the days of the first and the last, as far as known.

    `judged` of them were compared with a baseline, and `alarming` of these have an alarm.
    """

    machine: str
    runs: int = 0
    judged: int = 0
    alarming: int = 0
    quarantined: int = 0
    first: datetime | None = None
    last: datetime | None = None

    def count(self, row: dict[str, Any]) -> None:
        """Count the run of a row of `runs`."""
        recorded = row["recorded_from"]
        self.runs += 1
        self.judged += row["baseline"] is not None
        self.alarming += bool(row["alarms"])
        if recorded is not None:
            self.first = min(self.first or recorded, recorded)
            self.last = max(self.last or recorded, recorded)

    @property
    def plain(self) -> dict[str, Any]:
        """Plain data, the days in ISO 8601."""
        days = {name: when and when.date().isoformat() for name, when in (("first", self.first), ("last", self.last))}
        numbers = {name: getattr(self, name) for name in ("runs", "judged", "alarming", "quarantined")}
        return {"machine": self.machine, **numbers, **days}


def machines(lake: Lake) -> list[MachineRuns]:
    """The machines of the lake by name, with the numbers of their runs and of recordings in quarantine."""
    machines_by_name: dict[str, MachineRuns] = {}
    for row in lake.read("runs", _COLUMNS).to_pylist():
        machines_by_name.setdefault(path_of(row), MachineRuns(path_of(row))).count(row)
    for row in quarantine(lake):
        machines_by_name.setdefault(path_of(row), MachineRuns(path_of(row))).quarantined += 1
    return [machines_by_name[name] for name in sorted(machines_by_name)]


def quarantine(lake: Lake) -> list[dict[str, Any]]:
    """The recordings that could not be tracked, as the newest livebode that tried them reports."""
    runs = lake.read("runs", ["content", "recipe"])
    done, newest = set(zip(runs["content"].to_pylist(), runs["recipe"].to_pylist())), {}
    for row in sorted(lake.read("quarantine").to_pylist(), key=lambda row: Version(row["livebode"])):
        if (key := (row["content"], row["recipe"])) not in done:
            newest[key] = row
    return sorted(newest.values(), key=lambda row: (row["url"], row["recipe"]))


def path_of(row: Mapping[str, Any]) -> str:
    """The machine as site/line/machine/axis; levels that are not known are left out.

    >>> path_of({"site": "Graz", "line": None, "machine": "press 4", "axis": "x"})
    'Graz/press 4/x'
    """
    return "/".join(row[level] for level in LEVELS if row[level])


_RUNS_MAX = 100


def alarms_of(lake: Lake, of: Selection) -> tuple[int, list[RunAlarm]]:
    """Number of the selected runs with an alarm, and the alarms of the newest hundred, the newest run first.

    Raises
    ------
    ArchiveError
        If the lake cannot be read.
    """
    columns = ["content", "recipe", *LEVELS, "recorded_from", "alarms"]
    rows = lake.read("runs", columns, where_of(of)).filter(pc.field("alarms") > 0)
    newest = rows.sort_by([("recorded_from", "descending"), ("content", "ascending")]).to_pylist()
    newest = [row for row in newest if of.includes(path_of(row) or UNNAMED)]
    return len(newest), [alarm for row in newest[:_RUNS_MAX] for alarm in _alarms(LakeRun(lake, row))]


def _alarms(run: LakeRun) -> Iterable[RunAlarm]:
    begin = run.recorded_from.timestamp() if run.recorded_from else None
    events = run.lake.rows_of("events", run.key)
    for row in events.filter(pc.field("kind") == "change").select(["message", "details"]).to_pylist():
        yield RunAlarm(path_of(run.row) or UNNAMED, begin, recorded(json.loads(row["details"]), row["message"]))
