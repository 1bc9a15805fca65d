"""`livebode archive compare`: what differs between two axes, or between two spans of one."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from livebode.cli import Json, NextCommand
from livebode.core import ArchiveError, UsageError
from livebode_plant.cli.archive.selection import LakeOf, SelectionOptions, print_table, with_selection

if TYPE_CHECKING:
    from livebode_plant.lake import Lake
    from livebode_plant.trending import History, LevelDifference, MachineHistory, Selection

_COLUMNS = ("quantity", "first", "second", "difference", "in %", "unit", "runs")


@with_selection("since", "until", "covariate")
def compare_command(
    archive: LakeOf,
    first: Annotated[str, typer.Argument(metavar="AXIS", help="site/line/machine/axis.")],
    chosen: SelectionOptions,
    second: Annotated[
        str | None, typer.Argument(metavar="OTHER", help="Another axis. \\[default: the same one, from --split on]")
    ] = None,
    split: Annotated[
        str | None, typer.Option(metavar="DATE", help="Compare the runs before this day with those from it on.")
    ] = None,
    as_json: Json = False,
) -> NextCommand | None:
    """Find the quantities that differ between two axes, or between two spans of one, with bounds.

    The influence of the covariates is removed. An asterisk marks what chance does not explain: at most 5 % of the
    differences marked are expected to be none.
    """
    from livebode.records import to_json
    from livebode_plant.archive.archive_settings import lake_url
    from livebode_plant.lake import Lake
    from livebode_plant.trending import differences

    if (second is None) == (split is None):
        raise UsageError(
            "missing", "there is nothing to compare with, or twice", "name another axis, or --split DATE",
            argument="--split",
        )  # fmt: skip
    different, few = differences(_pairs(Lake(lake_url(archive)), chosen.selection(), first.strip("/"), second, split))
    if as_json:
        print(to_json({"differences": [vars(difference) for difference in different], "too_few_runs": few}))
        return None
    if different:
        print_table(_COLUMNS, map(_row, different))
    for name in few:
        print(f"{name}: not compared: fewer than 8 runs on a side")
    if any(difference.significant for difference in different):
        print("*: at most 5 % of the differences marked are expected to be none")
    names = [f"{difference.model}:{difference.name}" for difference in different]
    return NextCommand("archive", *(["trend", archive, names[0]] if names else ["list", archive]))


def _row(of: LevelDifference) -> tuple[str, ...]:
    from livebode.core import with_bound
    from livebode.language import quantity_name

    percent = 100 / abs(of.first) if of.first and of.unit != "dB" else None
    return (
        quantity_name(of.name) + " *" * of.significant, f"{of.first:.5g}", f"{of.second:.5g}",
        " ± ".join(with_bound(of.amount, of.bound_95)),
        "" if percent is None else " ± ".join(with_bound(percent * of.amount, percent * of.bound_95)), of.unit,
        f"{of.runs[0]} / {of.runs[1]}",
    )  # fmt: skip


def _pairs(
    lake: Lake, of: Selection, first: str, second: str | None, split: str | None
) -> list[tuple[History, MachineHistory, MachineHistory]]:
    """Each quantity that both sides have."""
    from livebode.core import nearest_name
    from livebode_plant.cli.archive.selection import day
    from livebode_plant.trending import histories

    if second is not None:
        before = after = histories(lake, of)
    else:
        since = day(split, "--split")
        before, after = histories(lake, replace(of, until=since)), histories(lake, replace(of, since=since))
    names = {axis for history in (*before, *after) for axis in history.machines}
    for axis in (first, second or first):
        if axis not in names:
            raise UsageError(
                "not-one-of", f"the lake has no axis {axis!r}", nearest_name(axis, sorted(names), "Axes"),
                argument="axis", value=axis,
            )  # fmt: skip
    later = {(history.model, history.name): history for history in after}
    pairs = [
        (history, history.machines[first], other.machines[second or first])
        for history in before
        if (other := later.get((history.model, history.name))) is not None
        and first in history.machines
        and (second or first) in other.machines
    ]
    if not pairs:
        sides = f"{first} and {second}" if second else f"the runs of {first} before and from {split} on"
        raise ArchiveError(
            "nothing-in-common",
            f"{sides} have no quantity in common",
            "compare axes or days with runs of the same [fit] model: `livebode archive list` shows them",
        )
    return pairs
