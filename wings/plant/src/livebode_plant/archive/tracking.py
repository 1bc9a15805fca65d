"""Track one recording, and write its tables to the lake's directory; nothing is committed here."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from datetime import datetime
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from livebode.configuration import Axis, open_recording, recorded_configuration
from livebode.records import entries_of, lines_in, to_json
from livebode.runtime import Destination, run
from livebode.version import __version__
from livebode_plant.archive.job import Job
from livebode_plant.archive.lake_record import LakeRecord
from livebode_plant.archive.recordings import RecordingPlace, levels_of
from livebode_plant.archive.results import Tracked
from livebode_plant.lake import Key, Lake


def track(job: Job, place: RecordingPlace, path: Path, key: Key, scratch: Path | None = None) -> Tracked:
    """Track a recording by a recipe, and put the files of its result in the lake's directory.

    Raises
    ------
    LivebodeError
        If the recording cannot be tracked by this recipe, or the lake not written.
    """
    levels = levels_of(place, job.machine(key.recipe))
    axis = job.axis_for(key.recipe, path, levels)
    with tempfile.TemporaryDirectory(prefix="livebode-", dir=scratch) as folder:
        record = LakeRecord(Path(folder), key)
        run(axis, Destination(Path(folder), _no_pictures, record=record))
        lake = Lake(job.lake)
        for file in record.files:
            lake.store(Path(folder) / file.table / file.name, file.table)
    common = key._asdict() | levels
    return Tracked(record.files, common | _about(record, place), tuple(_quantities(axis, record, common)))


def _no_pictures(*_: object) -> None:
    """An archive draws when somebody looks."""


def _about(record: LakeRecord, place: RecordingPlace) -> dict[str, Any]:
    """Row of the table `runs`, without what all tables have; an output-only run has no response and no lines.

    Of a matrix run, `responses` counts its matrices.
    """
    found, recorded = record.summary["found"], record.summary.get("recorded") or {}
    monitoring = record.summary.get("monitoring", {})
    rows = {file.table: file.rows for file in record.files}
    lines = lines_in(found) if "bins" in found else None
    if entries := entries_of(record.summary):
        rows["responses"] //= len(entries)  # of a matrix there is a row for each entry
    return {
        "url": str(place.url),
        "recorded_from": _moment(recorded.get("from")),
        "recorded_to": _moment(recorded.get("to")),
        "clock": recorded.get("clock", "unknown"),
        "duration_s": record.summary["counts"]["samples"] / found["rate_hz"],
        "rate_hz": float(found["rate_hz"]),
        "window": found["window"],
        "quantity": found.get("quantity"),
        "unit": found.get("unit"),
        "frequencies_hz": [] if lines is None else lines.frequency_hz.tolist(),
        "quiet_bins": [] if lines is None else list(lines.quiet),
        "livebode": __version__,
        "alarms": monitoring.get("changes", 0),
        "baseline": monitoring.get("baseline_id"),
        "summary": json.dumps(_summary(record), sort_keys=True, ensure_ascii=False),
    } | {name: rows.get(name, 0) for name in ("responses", "parameters", "events")}


def _summary(record: LakeRecord) -> dict[str, Any]:
    """What `LakeRun` needs of run.json: nothing in it depends on where and when the recording was tracked."""
    summary = json.loads(to_json(record.summary))
    configuration = recorded_configuration(summary)
    del configuration["source"]["log"]
    configuration.pop("machine", None)
    for file in ("baseline", "gantry"):
        configuration.get("monitoring", {}).pop(file, None)
    more = {name: summary[name] for name in ("left_out_samples", "matrix") if name in summary}
    return {"configuration": configuration, "found": summary["found"]} | more


def _quantities(axis: Axis, record: LakeRecord, common: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Rows of the table `quantities`."""
    recorded_from = _moment((record.summary.get("recorded") or {}).get("from"))
    points = sorted(record.fitted.points(record.summary), key=lambda point: (point.model, point.name))
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
