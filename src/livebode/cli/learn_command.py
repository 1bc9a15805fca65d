"""`livebode learn`: a baseline from runs of the healthy machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from livebode.cli import terminal
from livebode.cli.next_step import NextCommand
from livebode.cli.options import Json
from livebode.core import UsageError, counted
from livebode.locations import location


def learn_command(
    runs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="RUN…", help="Run directories of the healthy machine.", parser=location),
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="BASELINE", help="JSON file to write.")] = None,
    reason: Annotated[
        str | None,
        typer.Option(
            metavar="TEXT",
            help="Why this baseline is learned. An existing file is then replaced as its next version: the earlier "
            "ones are retained in NAME.history beside it.",
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file; a baseline is retained.")] = False,
    history: Annotated[
        Path | None, typer.Option(metavar="BASELINE", help="List the versions of a baseline, and learn nothing.")
    ] = None,
    as_json: Json = False,
) -> NextCommand | None:
    """Learn a baseline from runs of the healthy machine, for `livebode run --baseline`."""
    from livebode.cli.learned_baseline import baseline_text, check_replaceable, write_baseline
    from livebode.records import to_json

    if history is not None:
        _check_alone(runs, out)
        print(_history(history, as_json=as_json))
        return None
    if out is None:
        raise UsageError("missing", "the file of the baseline is not named", "give --out BASELINE", argument="out")
    from livebode.analysis import learn  # with the simulation

    check_replaceable(out, reason, force=force)
    console = terminal.console(stderr=True)
    with console.status("reading the runs", spinner="line") as status:
        learned = learn(runs or [], report=status.update)
    found = write_baseline(learned, out, reason, force=force)
    file = found.pop("file")
    print(to_json(found) if as_json else f"{baseline_text(found)}\n{file}")
    return _next(out, runs or [])


def _next(baseline: Path, runs: list[Path]) -> NextCommand:
    """The newest run again, compared with the baseline, where its configuration is beside; else the versions."""
    axis = Path(f"{runs[-1].name}.toml")
    return NextCommand("run", axis, baseline=baseline) if axis.is_file() else NextCommand("learn", history=baseline)


def _check_alone(runs: list[Path] | None, out: Path | None) -> None:
    """UsageError if something is to be learned too."""
    if runs or out is not None:
        raise UsageError(
            "conflict", "a history is listed, or a baseline is learned", "give --history alone", options=["--history"]
        )


def _history(path: Path, *, as_json: bool) -> str:
    """The versions of the baseline in a file, the newest first."""
    from livebode.monitoring import Baseline, retained_file
    from livebode.records import to_json

    baseline = Baseline.load(path)
    versions = [
        {
            "id": version.id,
            "learned": version.learned or None,
            "reason": version.reason,
            "runs": list(version.runs),
            "file": str(file) if file.exists() else None,
        }
        for version, file in [
            (baseline.version, path),
            *((version, retained_file(path, version.id)) for version in baseline.history),
        ]
    ]
    if as_json:
        return to_json({"baseline": str(path), "versions": versions})
    return "\n".join([f"{path}: {counted(len(versions), 'version')}, the newest first", *map(_version, versions)])


def _version(version: dict[str, Any]) -> str:
    when = version["learned"].replace("T", " ").replace("+00:00", " UTC")
    reason = f"reason: {version['reason']}" if version["reason"] else "no reason stated"
    file = version["file"] or "its file is not here"
    return f"{version['id']}  learned {when}; {reason}\n    {file}\n    from {', '.join(version['runs'])}"
