"""HealthyRuns: the runs of an axis that a baseline is learned from, and what speaks against learning from them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from livebode.core import LEVELS, ArchiveError, counted, nearest_name
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
        """Its site, line, machine and axis."""
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
    found = []
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
        found += sorted(own)
    return found


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
        for one in assessment.ranked:
            if one.significant:
                jumped = any(change.kind == "jump" for change in one.trend.changes)
                words = sentence(one, history.name, history.unit_of(one.machine)).rstrip(".")
                (jumps if jumped else drifts).setdefault(one.machine, []).append(words)
    return jumps, drifts


def _remarks(runs: Sequence[LakeRun]) -> Iterator[str]:
    dated = sum(run.recorded_from is not None for run in runs)
    if len(runs) < _FEW:
        yield f"{counted(len(runs), 'run')}: differences from run to run are not known below {_FEW}"
    elif dated < RUNS_MIN:
        yield f"{counted(dated, 'run')} with a date: jumps between them are looked for from {RUNS_MIN} on"
