"""Tasks of a worker: a recording is hashed, tracked and written to the lake's directory; a failure touches no other."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from datetime import datetime
from math import isfinite, nan
from pathlib import Path
from typing import Any, Self

import numpy as np
import pyarrow as pa

from livebode.analysis import FittedQuantities
from livebode.configuration import Axis, open_recording, recipe_id, recorded_configuration
from livebode.core import ArchiveError, ConfigError, Event, MatrixResponses, Responses, writing
from livebode.dataclass import dataclass
from livebode.locations import local_copy
from livebode.records import content_sha256, entries_of, lines_in, parameter_rows, to_json
from livebode.runtime import Destination, Document, FitResults, RecordInOnePiece, run
from livebode.tables import from_numpy, text
from livebode.version import __version__
from livebode_plant.archive.archive_settings import Template
from livebode_plant.archive.archived_recordings import (
    ArchivedRecording,
    HashedContent,
    RecordingPlace,
    RecordingResults,
    Result,
    TrackedResult,
    failed,
    levels_of,
)
from livebode_plant.lake import DataFile, Key, Lake
from livebode_plant.lake.data_file import ResultFileWriter
from livebode_plant.lake.wide_responses import covariance_to_wide, entries_to_wide, to_wide

_DIGITS = 16


@dataclass(frozen=True)
class Job:
    """What all recordings of an archive have in common.

    Attributes
    ----------
    recipes
        The axes that are tracked of each recording, by the id of their recipe.
    lake
        URL of the lake.
    memory_bytes
        Memory that tracking one recording may use.
    baselines
        Path of the baseline of each machine, with its levels in braces; None: no comparison.
    known
        The first 16 digits of contents that have all results already, of those that a new recording may have.
    """

    recipes: Mapping[str, Axis]
    lake: str
    memory_bytes: int
    baselines: str | None = None
    known: frozenset[str] = frozenset()

    @classmethod
    def of(cls, axes: Mapping[str, Axis], lake: str, memory_bytes: int, baselines: str | None = None) -> Job:
        """The job of a recipe's axes.

        Raises
        ------
        ConfigError
            If two axes have the same settings: their results would have one name.
        RecordingError
            If a file of the recipe cannot be read.
        """
        named: dict[str, str] = {}
        for name, axis in axes.items():
            same = named.setdefault(recipe_id(axis), name)
            if same != name:
                raise ConfigError(
                    "key-conflict",
                    f"the axes {same} and {name} of the recipe have the same settings, so their results are the same",
                    "remove one of them, or give it its own channels",
                    key="axes",
                    names=[same, name],
                )
        return cls({recipe: axes[name] for recipe, name in named.items()}, lake, memory_bytes, baselines)

    def knows(self, content: str) -> bool:
        """Whether a content has all results already."""
        return content[:_DIGITS] in self.known

    def machine(self, recipe: str) -> dict[str, str]:
        """Levels of the machine of a recipe, for recordings whose place names none."""
        machine = self.recipes[recipe].machine if recipe in self.recipes else None
        return machine.levels if machine else {}

    def axis_for(self, recipe: str, path: Path, levels: Mapping[str, str | None]) -> Axis:
        """The recipe for the recording in this file, compared with the baseline of its machine if there is one."""
        axis = self.recipes[recipe]
        axis = axis.model_copy(update={"source": axis.source.model_copy(update={"log": path})})
        file = None if self.baselines is None else Template(self.baselines).filled(levels)
        if file is None or not Path(file).exists():
            return axis
        return axis.model_copy(update={"monitoring": axis.monitoring.model_copy(update={"baseline": Path(file)})})

    @property
    def common_machine(self) -> dict[str, str]:
        """The levels that all recipes have in common."""
        each = [set(self.machine(recipe).items()) for recipe in self.recipes]
        return dict(sorted(set.intersection(*each)))


def short(content: str) -> str:
    """The digits of a content in `Job.known`."""
    return content[:_DIGITS]


_EVENTS = 10_000


class LakeRecord(RecordInOnePiece):
    """Writes responses or matrices of them, parameters and events to files of the lake's layout as they come.

    Parameters
    ----------
    path
        An existing directory for files of several groups of rows.
    key
        The result.

    Attributes
    ----------
    files
        The files with rows and what each contains (`DataFileWriter.content`), when the run is finished.
    fitted
        The valid fits.
    summary
        The run as in run.json.
    """

    def __init__(self, path: Path, key: Key) -> None:
        self.path, self._key = path, key
        self.files: dict[DataFile, bytes | Path] = {}
        self.fitted = FittedQuantities()
        self.summary: dict[str, Any] = {}
        self._events: list[Event] = []
        self._open = ExitStack()
        self._writers: dict[str, ResultFileWriter] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None:
        with suppress(*((OSError, pa.ArrowException) if error else ())):  # on a full disk, closing fails as well
            self._open.close()

    def take(self, document: Document) -> None:
        with writing(self.path):
            match document:
                case Responses():
                    self._write("responses", to_wide(document))
                case MatrixResponses():
                    self._write("responses", entries_to_wide(document))
                    self._write("covariance", covariance_to_wide(document))
                case FitResults(parts):
                    for part in parts:
                        rows = parameter_rows(part)
                        self._write("parameters", pa.table(rows))
                        self.fitted.add(rows)
                case Event():
                    self._events.append(document)
                    if len(self._events) == _EVENTS:
                        self._write_events()

    def finish(self, summary: dict[str, Any], draw: Callable[[Path], None]) -> None:  # noqa: ARG002 - no pictures
        self.summary = summary
        with writing(self.path):
            self._write_events()
            written = {writer.finish(): writer.content for writer in self._writers.values()}
        self.files = {file: content for file, content in written.items() if file.rows}

    def _write(self, table: str, rows: pa.Table) -> None:
        if table not in self._writers:
            self._writers[table] = self._open.enter_context(ResultFileWriter(self.path, table, self._key))
        self._writers[table].write(rows)

    def _write_events(self) -> None:
        events, self._events = self._events, []
        if events:
            self._write("events", _rows_of(events))


def _rows_of(events: list[Event]) -> pa.Table:
    times = [event.time_s if isfinite(event.time_s) else nan for event in events]
    columns = {
        "kind": _text([event.kind for event in events]),
        "sample": from_numpy(np.array([event.sample for event in events], dtype=np.int64)),
        "time_s": from_numpy(np.array(times, dtype=np.float64)),
        "message": _text([event.message for event in events]),
        "details": _text([_details(event) for event in events]),
    }
    return pa.table(list(columns.values()), names=list(columns))


def _details(event: Event) -> str:
    return json.dumps(json.loads(to_json(event.details)), sort_keys=True, ensure_ascii=False)


def _text(words: list[str]) -> pa.Array[Any]:
    return text(words, np.arange(len(words)))


def track(job: Job, place: RecordingPlace, path: Path, key: Key, scratch: Path | None = None) -> TrackedResult:
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
        for file, content in record.files.items():
            lake.store(file, content)
    common = key._asdict() | levels
    return TrackedResult(tuple(record.files), common | _about(record, place), tuple(_quantities(axis, record, common)))


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


def handle(job: Job, recordings: Sequence[ArchivedRecording], scratch: Path | None = None) -> list[RecordingResults]:
    """Hash and track each recording; files are written, and nothing is committed."""
    return [handle_one(job, recording, scratch) for recording in recordings]


def handle_one(job: Job, recording: ArchivedRecording, scratch: Path | None = None) -> RecordingResults:
    """Hash and track one recording."""
    started = time.perf_counter()
    return RecordingResults(tuple(_results(job, recording, scratch)), time.perf_counter() - started)


def _results(job: Job, recording: ArchivedRecording, scratch: Path | None) -> Iterator[Result]:
    """The content if it was not known, and the result of each recipe."""
    place = recording.place
    try:
        with local_copy(place.url) as path:
            content = content_sha256(path)
            if not recording.content:
                yield HashedContent(place, content)
                if job.knows(content):
                    return
            elif content != recording.content:
                raise _changed(place.url)
            for recipe in recording.recipes:
                yield _result(job, recording, path, Key(content, recipe), scratch)
    except Exception as error:
        yield failed(place, error)


def _result(job: Job, recording: ArchivedRecording, path: Path, key: Key, scratch: Path | None) -> Result:
    try:
        result = track(job, recording.place, path, key, scratch)
        if content_sha256(path) != key.content:
            raise _changed(recording.place.url)
    except Exception as error:
        return failed(recording.place, error, *key)
    return result


def _changed(url: object) -> ArchiveError:
    return ArchiveError("changed-meanwhile", f"{url} changed while the archive was tracked", "run it again")
