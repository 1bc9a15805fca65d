"""`livebode archive learn`: a baseline of each machine, from its healthy runs in a lake."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from livebode.cli import Json, NextCommand, console
from livebode.core import ConfigError, LivebodeError, UsageError, counted
from livebode_plant.cli.archive.selection import LakeOf, SelectionOptions, with_selection

if TYPE_CHECKING:
    from livebode_plant.archive.archive_settings import ArchiveSettings
    from livebode_plant.archive.learning import HealthyRuns
    from livebode_plant.lake import Lake

_REFUSED = 2


@with_selection("below", "since", "until")
def learn_command(
    archive: LakeOf,
    chosen: SelectionOptions,
    each: Annotated[bool, typer.Option("--each", help="A baseline for each of several axes.")] = False,
    out: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="JSON file to write, for several axes with their levels in braces: 'baselines/{machine}-{axis}.json'. "
            "\\[default: baselines in archive.toml]",
        ),
    ] = None,
    exclude: Annotated[
        list[str] | None,
        typer.Option(metavar="RECORDING", help="Recording to leave out, by content, URL or name; repeat for several."),
    ] = None,
    accept: Annotated[bool, typer.Option("--accept", help="Learn from runs with alarms or jumps, too.")] = False,
    reason: Annotated[
        str | None,
        typer.Option(
            metavar="TEXT",
            help="Why the baseline is learned. An existing file is then replaced as its next version: the earlier ones "
            "are retained in NAME.history beside it.",
        ),
    ] = None,
    as_json: Json = False,
) -> NextCommand:
    """Learn a baseline of one machine, or of each machine of a hall, from its healthy runs in the lake.

    Nothing is tracked again. Only a model of a moving machine needs the recordings, which are then read where the
    lake knows them. Runs with an alarm or a jump are refused. `livebode archive run` compares new recordings with these
    baselines if archive.toml names them (baselines).
    """
    from livebode.cli import check_replaceable
    from livebode.records import to_json
    from livebode_plant.archive.archive_settings import lake_url
    from livebode_plant.archive.learning import contents_of, healthy_runs
    from livebode_plant.lake import Lake

    settings = _settings(archive)
    lake = Lake(settings.lake if settings else lake_url(archive))
    of = replace(chosen, recipe=_recipe(settings)).selection()
    axes = healthy_runs(lake, of.without(contents_of(lake, exclude or ())))
    files = _files(axes, out or (settings.baselines if settings else None), each=each)
    for file in files:
        check_replaceable(file, reason, force=False)
    learned: list[dict[str, Any]] = []
    refused: dict[str, LivebodeError] = {}
    for one, file in zip(axes, files):
        try:
            learned.append(_learned(lake, one, file, reason, accept=accept))
        except LivebodeError as error:
            if not each:
                raise
            refused[one.axis] = error
            continue
        if not as_json:
            _print(learned[-1], short=each)
    if as_json:
        bad = [{"machine": axis} | why.as_dict() for axis, why in refused.items()]
        print(
            to_json({"baselines": [{k: v for k, v in one.items() if k != "file"} for one in learned], "refused": bad})
        )
    else:
        for axis, why in refused.items():
            print(f"livebode: {axis}: {why}", file=sys.stderr)
    if refused:
        raise typer.Exit(_REFUSED)
    compares = settings is not None and settings.baselines is not None
    return NextCommand("archive", "run" if compares else "list", archive)


def _settings(archive: str) -> ArchiveSettings | None:
    from livebode_plant.archive.archive_settings import ArchiveSettings

    return ArchiveSettings.read(Path(archive)) if archive.lower().endswith(".toml") else None


def _recipe(settings: ArchiveSettings | None) -> str | None:
    """The recipe of the archive: what is tracked from now on is compared with the baseline.

    None with several axes: each has the recipe of its most runs.
    """
    from livebode.configuration import recipe_id

    axes = list(settings.axes().values()) if settings else []
    return recipe_id(axes[0]) if len(axes) == 1 else None


def _files(axes: Sequence[HealthyRuns], text: str | None, *, each: bool) -> list[Path]:
    """The file of each axis."""
    from livebode_plant.archive.archive_settings import Template, check_baselines

    if text is None:
        raise UsageError("missing", "the file of the baseline is not named", "give --out FILE", argument="out")
    if len(axes) > 1 and not each:
        names = ", ".join(axis.axis for axis in axes[:5]) + ", …" * (len(axes) > 5)
        raise UsageError(
            "missing",
            f"{len(axes)} axes are selected ({names})",
            "choose one with --machine, or learn a baseline for each with --each",
            options=["--machine", "--each"],
        )
    try:
        check_baselines(text, "out")
    except ConfigError as error:
        raise UsageError("unreadable", error.message, error.remedy, argument="out", value=text) from None
    files = [Template(text).filled(axis.levels) for axis in axes]
    for axis, file in zip(axes, files):
        if file is None or files.count(file) > 1:
            why = "has a level that is not known" if file is None else "is that of several axes"
            raise UsageError(
                "unreadable",
                f"the file of {axis.axis}, {text!r}, {why}",
                "name other levels in it: {site}, {line}, {machine}, {axis}",
                argument="out",
                value=text,
            )
    return [Path(file) for file in files if file is not None]


def _learned(lake: Lake, of: HealthyRuns, file: Path, reason: str | None, *, accept: bool) -> dict[str, Any]:
    from livebode.cli import write_baseline
    from livebode_plant.archive.learning import learn_of_lake  # with the simulation

    if not accept:
        of.check()
    with console(stderr=True).status(f"reading the runs of {of.axis}", spinner="line") as status:
        learned = learn_of_lake(lake, of.runs, lambda text: status.update(f"{of.axis}: {text}"))
    read = {name: getattr(learned, name) for name in ("responses", "recordings", "size_bytes")}
    remarks = [*of.remarks, *(of.doubts if accept else ())]
    own = {"machine": of.axis, "read": read, "remarks": remarks}
    return own | write_baseline(learned.baseline, file, reason, force=False)


def _print(one: dict[str, Any], *, short: bool) -> None:
    from livebode.cli import baseline_text

    read = one["read"]
    text = f"{one['machine']}: {counted(len(one['runs']), 'run')}, {read['responses']:,} responses of the lake"
    if read["recordings"]:
        text += f", and {counted(read['recordings'], 'recording')} ({read['size_bytes'] / 1e6:,.1f} MB)"
    print(text)
    for remark in one["remarks"]:
        print(f"  {remark}")
    if not short:
        print(baseline_text(one))
    print(one["file"] if not short else f"  {one['file']}")
