"""Track one recording, and write its tables to the lake's directory; nothing is committed here."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from livebode.analysis.run_trend import trend_points
from livebode.archive.recordings import ArchivedRecording, levels_of
from livebode.archive.template import Template
from livebode.configuration.axis import Axis
from livebode.configuration.recorded import recorded_configuration
from livebode.configuration.recording import open_recording
from livebode.core import ArchiveError, Event
from livebode.lake import DataFile, Key, Lake
from livebode.lake.data_file import write_data_file
from livebode.locations import local_copy
from livebode.records import RunRecord
from livebode.records.content import content_sha256
from livebode.records.wide_responses import to_wide
from livebode.runtime import Destination, run
from livebode.version import __version__

_EVENTS = 10_000


@dataclass(frozen=True)
class Job:
    """What all recordings of an archive have in common.

    Attributes
    ----------
    axis
        The recipe.
    recipe
        Its id.
    lake
        URL of the lake.
    memory_bytes
        Memory that tracking one recording may use.
    baselines
        Path of the baseline of each machine, with its levels in braces; None: no comparison.
    """

    axis: Axis
    recipe: str
    lake: str
    memory_bytes: int
    baselines: str | None = None

    @property
    def machine(self) -> dict[str, str]:
        """Levels of the machine for recordings whose place names none."""
        return self.axis.machine.levels if self.axis.machine else {}

    def axis_for(self, path: Path, levels: Mapping[str, str | None]) -> Axis:
        """The recipe for the recording in this file, compared with the baseline of its machine if there is one."""
        axis = self.axis.model_copy(update={"source": self.axis.source.model_copy(update={"log": path})})
        file = None if self.baselines is None else Template(self.baselines).filled(levels)
        if file is None or not Path(file).exists():
            return axis
        return axis.model_copy(update={"monitoring": axis.monitoring.model_copy(update={"baseline": Path(file)})})


@dataclass(frozen=True)
class TrackedRun:
    """The files of a result, and its rows of `runs` and `quantities`."""

    files: tuple[DataFile, ...]
    run: dict[str, Any]
    quantities: tuple[dict[str, Any], ...]


def track(job: Job, recording: ArchivedRecording, scratch: Path | None = None) -> TrackedRun:
    """Track a recording and put the files of its result in the lake's directory.

    Raises
    ------
    LivebodeError
        If the recording cannot be tracked by this recipe, or the lake not written.
    """
    key = Key(recording.content, job.recipe)
    with (
        tempfile.TemporaryDirectory(prefix="livebode-", dir=scratch) as folder,
        local_copy(recording.place.url) as path,
    ):
        if content_sha256(path) != recording.content:
            raise ArchiveError(
                "changed-meanwhile", f"{recording.place.url} changed while the archive was tracked", "run it again"
            )
        levels = levels_of(recording.place, job.machine)
        axis = job.axis_for(path, levels)
        run(axis, Destination(Path(folder) / "run", _no_pictures))
        record = RunRecord.open(Path(folder) / "run")
        files = tuple(_files(Path(folder), key, record))
        lake = Lake(job.lake)
        for file in files:
            lake.store(Path(folder) / file.table / file.name, file.table)
        common = key._asdict() | levels
        return TrackedRun(files, common | _about(record, recording, files), tuple(_quantities(axis, record, common)))


def _no_pictures(*_: object) -> None:
    """An archive draws when somebody looks."""


def _files(folder: Path, key: Key, record: RunRecord) -> Iterator[DataFile]:
    parts = {
        "responses": map(to_wide, record.batches()),
        "parameters": record.tables("parameters"),
        "events": _event_tables(record),
    }
    for table, rows in parts.items():
        (folder / table).mkdir()
        file = write_data_file(folder / table, table, key, rows)
        if file.rows:
            yield file


def _event_tables(record: RunRecord) -> Iterator[pa.Table]:
    rows: list[dict[str, Any]] = []
    for event in record.each_event():
        rows.append(_plain(event))
        if len(rows) == _EVENTS:
            yield pa.Table.from_pylist(rows)
            rows = []
    if rows:
        yield pa.Table.from_pylist(rows)


def _plain(event: Event) -> dict[str, Any]:
    details = json.dumps(event.details, sort_keys=True, ensure_ascii=False)
    return {"kind": event.kind, "sample": event.sample, "time_s": float(event.time_s), "message": event.message} | {
        "details": details
    }


def _about(record: RunRecord, recording: ArchivedRecording, files: tuple[DataFile, ...]) -> dict[str, Any]:
    """Row of the table `runs`, without what all tables have."""
    found, recorded = record.found, record.summary.get("recorded") or {}
    monitoring = record.summary.get("monitoring", {})
    rows = {file.table: file.rows for file in files}
    return {
        "url": str(recording.place.url),
        "recorded_from": _moment(recorded.get("from")),
        "recorded_to": _moment(recorded.get("to")),
        "clock": recorded.get("clock", "unknown"),
        "duration_s": record.summary["counts"]["samples"] / found["rate_hz"],
        "rate_hz": float(found["rate_hz"]),
        "window": found["window"],
        "quantity": found["quantity"],
        "unit": found["unit"],
        "frequencies_hz": record.lines.frequency_hz.tolist(),
        "quiet_bins": list(record.lines.quiet),
        "livebode": __version__,
        "alarms": monitoring.get("changes", 0),
        "baseline": monitoring.get("baseline_id"),
        "summary": json.dumps(_summary(record), sort_keys=True, ensure_ascii=False),
    } | {name: rows.get(name, 0) for name in ("responses", "parameters", "events")}


def _summary(record: RunRecord) -> dict[str, Any]:
    """What `LakeRun` needs of run.json: nothing in it depends on where and when the recording was tracked."""
    configuration = recorded_configuration(record.summary)
    del configuration["source"]["log"]
    configuration.pop("machine", None)
    configuration.get("monitoring", {}).pop("baseline", None)
    transient = {name: record.summary[name] for name in ("left_out_samples",) if name in record.summary}
    return {"configuration": configuration, "found": record.found} | transient


def _quantities(axis: Axis, record: RunRecord, common: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Rows of the table `quantities`."""
    recorded_from = _moment((record.summary.get("recorded") or {}).get("from"))
    points = sorted(trend_points(record), key=lambda point: (point.model, point.name))
    covariates = sorted(_means(axis).items()) if points else []
    for point in points:
        yield common | vars(point) | {"recorded_from": recorded_from, "covariates": covariates}


def _means(axis: Axis) -> dict[str, float]:
    """Mean of each covariate over the recording; one without a finite sample is left out."""
    names = axis.monitoring.covariates
    if not names:
        return {}
    total, count = np.zeros(len(names)), np.zeros(len(names))
    for block in open_recording(axis).naming(names).blocks(names):
        finite = np.isfinite(block.data)
        total += np.where(finite, block.data, 0.0).sum(axis=1)
        count += finite.sum(axis=1)
    return {name: float(of / n) for name, of, n in zip(names, total, count) if n and isfinite(of)}


def _moment(text: str | None) -> datetime | None:
    return None if text is None else datetime.fromisoformat(text)
