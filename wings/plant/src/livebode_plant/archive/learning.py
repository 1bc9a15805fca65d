"""A baseline of a machine from its healthy runs in a lake, and what speaks against learning from them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc

from livebode.analysis import check_no_matrix, learn_from, learnable_axis, reads_recordings
from livebode.configuration import Axis
from livebode.core import LEVELS, ArchiveError, LivebodeError, counted, nearest_name
from livebode.dataclass import dataclass
from livebode.language import quantity_name
from livebode.locations import local_copy
from livebode.monitoring import Baseline
from livebode.records import content_sha256
from livebode_plant.archive.contents import path_of
from livebode_plant.lake import Lake, LakeRun
from livebode_plant.report.trend_words import sentence
from livebode_plant.trending import LIMIT_PERCENT, RUNS_MIN, Selection, assess, histories
from livebode_plant.trending.quantity_history import UNNAMED, recipe_of_each, where_of

_FEW = 3  # below, nothing is known of differences from run to run
_NAMED = 3
_BEGIN_MIN = 8
"""Digits of a content that name it."""


@dataclass(frozen=True)
class HealthyRuns:
    """The runs of an axis.

    Attributes
    ----------
    axis
        site/line/machine/axis.
    runs
        In the order of their dates.
    doubts
        Why the machine may not have been healthy: sentences without an end.
    remarks
        What limits the baseline.
    """

    axis: str
    runs: tuple[LakeRun, ...]
    doubts: tuple[str, ...]
    remarks: tuple[str, ...]

    @property
    def levels(self) -> dict[str, str | None]:
        """Site, line, machine and axis of the runs."""
        return {level: self.runs[0].row[level] for level in LEVELS}

    def check(self) -> None:
        """ArchiveError if there is a doubt."""
        if self.doubts:
            raise ArchiveError(
                "not-healthy",
                f"{self.axis} may not have been healthy: {'; '.join(self.doubts)}",
                "leave these runs out (since, until, exclude), or accept them",
                argument="accept",
                machine=self.axis,
                reasons=list(self.doubts),
            )


def healthy_runs(lake: Lake, of: Selection) -> list[HealthyRuns]:
    """The selected runs of each axis, with what alarms, jumps and their number say.

    Jumps are those of a trend of at least 20 runs that chance does not explain, among all axes and quantities; see
    `assess`.

    Raises
    ------
    ArchiveError
        If no run is selected, or the lake cannot be read.
    """
    of = replace(of, by="axis")
    axes, undated = _selected(lake, of)
    jumps, drifts = _changes(lake, of)
    return [
        HealthyRuns(
            axis, tuple(runs), (*_alarms(runs), *jumps.get(axis, ())),
            (*_remarks(runs), *drifts.get(axis, ()), *undated.get(axis, ())),
        )
        for axis, runs in axes.items()
    ]  # fmt: skip


def contents_of(lake: Lake, names: Sequence[str]) -> list[str]:
    """The contents that these names mean: each the begin of a content, or the end of a recording's URL.

    Raises
    ------
    ArchiveError
        If a name means no recording.
    """
    tables = [lake.read(name, ["content", "url"]).to_pylist() for name in ("runs", "files")] if names else []
    known = {(row["content"], row["url"]) for rows in tables for row in rows}
    contents = []
    for name in names:
        own = {content for content, url in known if _means(name, content, url)}
        if not own:
            raise ArchiveError(
                "run-unknown",
                f"the lake has no recording {name!r}",
                nearest_name(name, sorted({url for _, url in known}), "Recordings"),
                argument="exclude",
                value=name,
            )
        contents += sorted(own)
    return contents


def _means(name: str, content: str, url: str) -> bool:
    return (len(name) >= _BEGIN_MIN and content.startswith(name)) or url == name or url.endswith(f"/{name}")


def _selected(lake: Lake, of: Selection) -> tuple[dict[str, list[LakeRun]], dict[str, list[str]]]:
    """The runs of each axis in the order of their dates, and a remark on those that are left out."""
    every = lake.read("runs", where=where_of(of))
    own = recipe_of_each(every, of.recipe)[0] if every.num_rows else every
    rows = own.sort_by([("recorded_from", "ascending"), ("content", "ascending")]).to_pylist()
    names = {path_of(row) or UNNAMED for row in rows}
    axes: dict[str, list[LakeRun]] = {}
    undated: dict[str, int] = {}
    for row in rows:
        axis = path_of(row) or UNNAMED
        if not of.includes(axis):
            continue
        if row["recorded_from"] is None and (of.since or of.until):
            undated[axis] = undated.get(axis, 0) + 1
            continue
        axes.setdefault(axis, []).append(LakeRun(lake, row))
    if not axes:
        below = f" of {of.below}" if of.below else ""
        raise ArchiveError(
            "machine-unknown",
            f"the lake has no run{below} with these dates and settings",
            nearest_name(of.below, sorted(names), "Axes") if of.below else "track recordings first",
            argument="machine",
            value=of.below,
        )
    remarks = {axis: [f"{counted(count, 'run')} without a date left out"] for axis, count in undated.items()}
    return dict(sorted(axes.items())), remarks


def _alarms(runs: Sequence[LakeRun]) -> Iterator[str]:
    if alarming := [run for run in runs if run.row["alarms"]]:
        named = ", ".join(_named(run) for run in alarming[:_NAMED]) + ", …" * (len(alarming) > _NAMED)
        yield f"{len(alarming)} of {counted(len(runs), 'run')} with an alarm ({named})"


def _named(run: LakeRun) -> str:
    day = f" of {run.recorded_from.date()}" if run.recorded_from else ""
    return f"{run.row['url'].rpartition('/')[2]}{day}"


def _changes(lake: Lake, of: Selection) -> tuple[dict[str, list[str]], dict[str, list[str]]]:
    """Sentences on the jumps of each axis, and on its other changes, such as a trend."""
    jumps: dict[str, list[str]] = {}
    drifts: dict[str, list[str]] = {}
    fitted = lake.read("quantities", ["recipe"])["recipe"].to_pylist()
    if not any(recipe.startswith(of.recipe or "") for recipe in fitted):
        return jumps, drifts
    for assessment in assess(histories(lake, of), LIMIT_PERCENT):
        history = assessment.history
        for ranked in assessment.ranked:
            if ranked.significant:
                jumped = any(change.kind == "jump" for change in ranked.trend.changes)
                words = sentence(ranked, quantity_name(history.name), history.unit_of(ranked.machine)).rstrip(".")
                (jumps if jumped else drifts).setdefault(ranked.machine, []).append(words)
    return jumps, drifts


def _remarks(runs: Sequence[LakeRun]) -> Iterator[str]:
    dated = sum(run.recorded_from is not None for run in runs)
    if len(runs) < _FEW:
        yield f"{counted(len(runs), 'run')}: differences from run to run are not known below {_FEW}"
    elif dated < RUNS_MIN:
        yield f"{counted(dated, 'run')} with a date: jumps between them are looked for from {RUNS_MIN} on"


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
    places = {run.key.content: [str(run.row["url"])] for run in runs}
    own = pc.field("content").isin(pa.array(list(places), pa.string()))
    for row in lake.read("files", ["content", "url"], own).sort_by("url").to_pylist():
        if row["url"] not in places[row["content"]]:
            places[row["content"]].append(row["url"])
    return places


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
