"""Runs without pictures, and a directory with the tables of another program."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from livebode.configuration import Axis, RecordSection
from livebode.estimation import Follower
from livebode.records import RUN, RunRecord
from livebode.records.segments.manifest import NAME as MANIFEST
from livebode.records.summary_file import to_document
from livebode.runtime import ChangeDetection, Destination, Feed, Fits, Outcome, RunLoop, SingleResponse, Subscriber, run
from livebode.runtime.feed import Source
from tests.support.command import write_parquet
from tools.parquet_parts import manifest_of


def small_run(folder: Path, columns: Mapping[str, np.ndarray], **sections: dict[str, object]) -> Path:
    """The directory of a run on these columns, with w, u and y; `sections` are those of the configuration besides."""
    given = {
        "source": {"log": write_parquet(folder / "log.parquet", columns)},
        "signals": {"output": "y", "input": "u", "excitation": "w"},
    }
    return run(Axis.of(given | sections, "test"), Destination(folder / "run", lambda *_: None)).directory


def describe(folder: Path, like: Path) -> None:
    """Write run.json and manifest of a run for the tables in a directory."""
    (folder / MANIFEST).write_bytes(listed := manifest_of(folder))
    (folder / RUN).write_bytes(to_document(RunRecord.open(like).summary | {"size_bytes": {MANIFEST: len(listed)}}))


def record(
    source: Source,
    follower: Follower,
    directory: Path,
    *,
    about: Mapping[str, Any] | None = None,
    subscribers: Sequence[Subscriber] = (),
    fits: Fits | None = None,
    detection: ChangeDetection | None = None,
    segments: RecordSection | None = None,
    again: bool = True,
) -> Outcome:
    """A run of these parts, which no configuration describes."""
    to = Destination(directory, lambda *_: None, subscribers=tuple(subscribers))
    estimate = SingleResponse(follower, fits, detection)
    about = {"configuration": {}} if about is None else dict(about)
    return RunLoop(Feed(source, again=again), estimate, to, about=about, segments=segments).run()
