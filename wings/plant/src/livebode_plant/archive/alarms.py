"""The alarms of a lake: what monitored recordings were reported with."""

from __future__ import annotations

import json
from collections.abc import Iterable

import pyarrow.compute as pc

from livebode.core import LEVELS
from livebode.language import recorded
from livebode_plant.archive.contents import path_of
from livebode_plant.lake import Lake, LakeRun
from livebode_plant.report.hall_report import RunAlarm
from livebode_plant.trending import Selection
from livebode_plant.trending.quantity_history import UNNAMED, where_of

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
