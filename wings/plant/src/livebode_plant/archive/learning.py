"""A baseline of a machine from its runs in a lake; recordings are read only for a model of the moving machine."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc

from livebode.analysis import check_no_matrix, learn_from, learnable_axis, reads_recordings
from livebode.configuration import Axis
from livebode.core import ArchiveError, LivebodeError
from livebode.locations import local_copy
from livebode.monitoring import Baseline
from livebode.records import content_sha256
from livebode_plant.lake import Lake, LakeRun


@dataclass(frozen=True)
class ArchivedBaseline:
    """A baseline, and what was read for it.

    Attributes
    ----------
    baseline
        What was learned.
    responses
        Number of responses in the lake.
    recordings, size_bytes
        Recordings that were read too, and their length: none if the machine has no schedule.
    """

    baseline: Baseline
    responses: int
    recordings: int
    size_bytes: int


def learn_of_lake(
    lake: Lake, runs: Sequence[LakeRun], report: Callable[[str], None] = lambda _: None
) -> ArchivedBaseline:
    """The baseline of these runs of a lake, the same as `learn` gives of run directories of their recordings.

    Nothing is tracked again. With a torque and a scheduling position, the recordings are read for a model of the moving
    machine: several times, from a local copy if they are at a URL. Each is read only if its content is that of the run.

    Raises
    ------
    ArchiveError
        If a recording that is needed is at none of its places any more.
    BaselineError
        If the runs do not match, or contain too little data.
    RecordError
        If a run has matrices.
    """
    check_no_matrix(runs)
    configurations = [run.summary["configuration"] for run in runs]
    axes = [_axis(run, own, run.row["url"]) for run, own in zip(runs, configurations)]
    size_bytes = recordings = 0
    with ExitStack() as copies:
        if axes and reads_recordings(axes[0]):
            places = _places(lake, runs)
            for number, (run, own) in enumerate(zip(runs, configurations)):
                report(f"checking recording {number + 1} of {len(runs)}")
                path = _recording(run, places[run.key.content], copies)
                axes[number] = _axis(run, own, str(path))
                size_bytes += _size_bytes(path)
            recordings = len(runs)
        baseline = learn_from(runs, axes, report)
    return ArchivedBaseline(baseline, sum(run.row["responses"] for run in runs), recordings, size_bytes)


def _axis(run: LakeRun, configuration: Mapping[str, dict[str, object]], log: str) -> Axis:
    source = {**configuration.get("source", {}), "log": log}
    return learnable_axis({**configuration, "source": source}, run.place)


def _places(lake: Lake, runs: Sequence[LakeRun]) -> dict[str, list[str]]:
    """Where the recording of each run was found, first the place from which it was tracked."""
    found = {run.key.content: [str(run.row["url"])] for run in runs}
    own = pc.field("content").isin(pa.array(list(found), pa.string()))
    for row in lake.read("files", ["content", "url"], own).sort_by("url").to_pylist():
        if row["url"] not in found[row["content"]]:
            found[row["content"]].append(row["url"])
    return found


def _recording(run: LakeRun, places: Sequence[str], copies: ExitStack) -> Path:
    """A local path of the recording, whose content was checked."""
    reason = "it has another content now"
    for place in places:
        with ExitStack() as own:
            try:
                path = own.enter_context(local_copy(place))
                if content_sha256(path) == run.key.content:
                    copies.enter_context(own.pop_all())
                    return path
            except LivebodeError as error:
                reason = str(error)
    raise ArchiveError(
        "recording-absent",
        f"the recording {places[0]} is not there as it was tracked: {reason}",
        "restore it, or leave the run out (exclude)",
        argument="exclude",
        content=run.key.content,
        places=list(places),
    )


def _size_bytes(path: Path) -> int:
    files = path.rglob("*") if path.is_dir() else [path]
    with suppress(OSError):
        return sum(file.stat().st_size for file in files if file.is_file())
    return 0
