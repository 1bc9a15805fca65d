"""State of a fleet, as its owners and its log report it: partitions, axes, backlog, losses, what needs a person."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from typing import Any

from livebode.configuration import Axis
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.reader import stored_messages
from livebode_plant.fleet.result_message import ResultMessage
from livebode_plant.fleet.subjects import (
    LOG,
    LOG_STREAM,
    RESULT_STREAM,
    RESULTS,
    SINK,
    STATUS,
    STATUS_STREAM,
    axis_path,
    key_of,
)

SILENT_S = 10.0
"""Silence after which an owner is reported."""
BACKLOG_SHARE_MAX = 0.7
"""Share of the log's capacity that is not processed yet, above which it is reported: at 1, data are lost."""


RESULTS_SHARE_MAX = 0.7
"""Share of log.results_gb that a sink has not stored yet, above which it is reported: at 1, results are lost."""


async def fleet_status(log: FleetLog, axes: Mapping[str, Axis]) -> dict[str, Any]:
    """Partitions, axes, the log, sinks that have run, and alarms, as plain data."""
    extent = await log.extent(LOG_STREAM, f"{LOG}.>")
    partitions = []
    reported: dict[str, dict[str, Any]] = {}
    now_s = time.time()
    stored = [subject.split(".")[1] for subject in (await log.extent(STATUS_STREAM)).subjects]
    sinks = await _sinks(log, sorted(name for name in stored if name.startswith(SINK)), now_s)
    for number in sorted(int(name) for name in stored if not name.startswith(SINK)):
        if (about := await status_of(log, number)) is None:
            continue
        for key, axis in about.pop("axes").items():
            reported[key] = {"axis": axis_path(key), "partition": about["partition"], **axis}
        silent_s = now_s - about.pop("at_s")
        partitions.append(about | {"silent_s": silent_s, "unknown": [axis_path(key) for key in about["unknown"]]})
    waiting = sum(partition["waiting"] for partition in partitions)
    full = extent.size_bytes / (log.settings.size_gb * 1e9)
    share = full * waiting / max(1, sum(extent.subjects.values()))
    about_log = {"messages": sum(extent.subjects.values()), "bytes": extent.size_bytes, "full_share": full}
    quota = log.settings.axis_messages
    full_axes = [axis_path(key_of(subject)) for subject, count in sorted(extent.subjects.items()) if count >= quota]
    silent = [axis_path(key) for key in axes if key not in reported]
    return {
        "partitions": partitions,
        "axes": sorted(reported.values(), key=lambda axis: str(axis["axis"])),
        "without_data": silent,
        "log": about_log | {"waiting": waiting, "backlog_share": share, "full_axes": full_axes},
        "sinks": sinks,
        "alarms": [
            *_alarms(partitions, list(reported.values()), share),
            *(
                f"{path} has log.axis_messages = {quota} messages in the log: its oldest are deleted, those of others "
                "are not; check its edge"
                for path in full_axes
            ),
            *_sink_alarms(sinks),
        ],
    }


async def _sinks(log: FleetLog, names: list[str], now_s: float) -> list[dict[str, Any]]:
    """How far each sink is behind the newest result."""
    if not names:
        return []
    extent = await log.extent(RESULT_STREAM)
    each_bytes = extent.size_bytes / max(1, extent.last - extent.first + 1)
    sinks = []
    for name in names:
        if (about := await status_of(log, name)) is not None:
            behind = max(0, extent.last - about["through"])
            share = min(behind * each_bytes, extent.size_bytes) / (log.settings.results_gb * 1e9)
            stored_s = about.pop("stored_s") or extent.created_s
            behind_s = max(0.0, now_s - stored_s) if behind else 0.0
            sinks.append(about | {"behind": behind, "behind_s": behind_s, "results_share": share})
    return sinks


def _sink_alarms(sinks: list[dict[str, Any]]) -> list[str]:
    return [
        f"the sink of {sink['lake']} has not stored {sink['results_share']:.0%} of log.results_gb yet: at 100 % "
        "results are deleted before they are in the lake; start livebode fleet sink, or raise log.results_gb"
        for sink in sinks
        if sink["results_share"] > RESULTS_SHARE_MAX
    ]


def _alarms(partitions: list[dict[str, Any]], axes: list[dict[str, Any]], share: float) -> list[str]:
    alarms = []
    if share > BACKLOG_SHARE_MAX:
        alarms.append(
            f"{share:.0%} of the log is not processed yet: at 100 % data are lost; add workers, or raise log.size_gb"
        )
    for partition in partitions:
        number, owner, silent_s = (partition[name] for name in ("partition", "owner", "silent_s"))
        if silent_s > SILENT_S:
            alarms.append(f"partition {number} is silent for {silent_s:.0f} s: check its worker {owner}")
        unknown = partition["unknown"]
        alarms += [f"data of {path} arrive, but the fleet has no such axis: add it to axes" for path in unknown]
    alarms += [f"{axis['axis']} is not tracked: {axis['failure']}" for axis in axes if axis["failure"]]
    alarms += [f"{axis['axis']} lost {axis['lost']} samples" for axis in axes if axis["lost"]]
    return alarms


async def silences(log: FleetLog, from_s: float, to_s: float) -> dict[int, float]:
    """For each partition the longest time between two messages of results that overlaps a span of time, in seconds."""
    extent = await log.extent(RESULT_STREAM)
    before: dict[int, float] = {}
    longest: dict[int, float] = {}
    async for message in stored_messages(log, RESULT_STREAM, f"{RESULTS}.*", extent.last, extent.first):
        number = int(message.subject.split(".")[1])
        if not ResultMessage.from_bytes(message.data).rows.num_rows:
            continue
        begun_s = before.get(number, message.stored_s)
        if message.stored_s >= from_s and begun_s <= to_s:
            longest[number] = max(longest.get(number, 0.0), message.stored_s - begun_s)
        before[number] = message.stored_s
    return longest


async def status_of(log: FleetLog, name: int | str) -> dict[str, Any] | None:
    """What the owner of a partition, by its number, or a sink has reported last; None if nothing is stored."""
    message = await log.last(STATUS_STREAM, f"{STATUS}.{name}")
    return None if message is None else json.loads(message.data)
