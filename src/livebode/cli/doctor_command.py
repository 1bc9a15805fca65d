"""`livebode doctor`: what is right and wrong with this computer and a configuration."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from livebode.cli import terminal
from livebode.cli.file_schema import print_schema
from livebode.cli.next_step import NextCommand
from livebode.cli.options import Json, check_use
from livebode.cli.receivers import show_receivers
from livebode.core import UsageError

if TYPE_CHECKING:
    from livebode.doctor import Check

_TABLE_COLUMNS = 80  # of a terminal; in a narrower one a table has no room for a sentence
_STYLES = {"not applicable": "dim", "ok": "green", "warning": "yellow", "failed": "bold red"}


def doctor_command(
    context: typer.Context,
    targets: Annotated[
        list[Path] | None, typer.Argument(metavar="[AXIS.toml] [RUN]", help="A configuration, and a run's directory.")
    ] = None,
    bundle: Annotated[
        Path | None,
        typer.Option(metavar="FILE.zip", help="Write what a report of a fault needs, without secrets."),
    ] = None,
    runs: Annotated[Path, typer.Option(metavar="DIR", help="Where runs are written: its disk is checked.")] = Path(
        "runs"
    ),
    receivers: Annotated[
        Literal["list", "test"] | None,
        typer.Option(
            help="Print what is sent to each receiver (\\[\\[publish]]) of AXIS.toml instead, or send a test message."
        ),
    ] = None,
    schema: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Print the JSON Schema of NAME.toml instead, by which an editor completes and checks the keys: axis, "
            "experiment, matrix-experiment (several motors) or archive.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="File for --schema. \\[default: standard output]")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an earlier bundle or schema.")] = False,
    as_json: Json = False,
) -> NextCommand | None:
    """Check this computer, a configuration and whether its machine can be reached; its receivers, its schema.

    Exit code 2 where a check or a test message failed. No data is changed; a live source is listened to for 3 s. The
    first line of a TOML file names the schema for the editor: `#:schema ./axis.schema.json`.
    """
    check_use(context, "--schema NAME", ("--out",), ("--force",))
    check_use(context, "--receivers list", ())
    if schema is not None:
        _check_targets(targets or [], "--schema", 0)
        print_schema(schema, out, force=force, as_json=as_json)
        return None
    if receivers is not None:
        _check_targets(targets or [], "--receivers", 1)
        show_receivers(targets[0] if targets else Path("axis.toml"), test=receivers == "test", as_json=as_json)
        return None
    return _check(targets or [], bundle, runs, force=force, as_json=as_json)


def _check_targets(targets: list[Path], option: str, most: int) -> None:
    """UsageError for more configurations than the option uses, or a run."""
    configurations = [path for path in targets if path.suffix.lower() == ".toml"][:most]
    if unused := [str(path) for path in targets if path not in configurations]:
        raise UsageError(
            "conflict", f"{unused[0]} and {option} exclude each other", "give one of them",
            options=[option], argument="targets", value=unused[0],
        )  # fmt: skip


def _check(targets: list[Path], bundle: Path | None, runs: Path, *, force: bool, as_json: bool) -> NextCommand | None:
    from livebode.doctor import Subject, examine, worst, write_bundle  # with the dashboard and the simulation
    from livebode.records import to_json

    subject = Subject.of(targets)
    checks = examine(subject, runs)
    verdict = worst(check.verdict for check in checks)
    files = None if bundle is None else write_bundle(bundle, subject, checks, force=force)
    if as_json:
        written = {} if files is None else {"bundle": str(bundle), "files": files}
        print(to_json({"verdict": verdict, "checks": [check.as_dict() for check in checks]} | written))
    else:
        _show(checks)
        if files is not None:
            print(f"{bundle}: {', '.join(files)}")
    if verdict == "failed":
        raise typer.Exit(2)
    runs_next = subject.configuration is not None and subject.sourced and subject.run_path is None
    return NextCommand("run", subject.configuration) if runs_next else None


def _show(checks: list[Check]) -> None:
    from rich.table import Table
    from rich.text import Text

    if terminal.is_terminal() and (console := terminal.console(markup=False)).width < _TABLE_COLUMNS:
        for check in checks:
            console.print(Text.assemble(f"{check.name}: ", (check.verdict, _STYLES[check.verdict])))
            console.print(f"  {check.message}" + (f"\n  → {check.remedy}" if check.remedy else ""), soft_wrap=True)
        return
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("check", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    table.add_column("result", overflow="fold")
    for check in checks:
        style = _STYLES[check.verdict]
        table.add_row(Text(check.name), Text(check.verdict, style), Text(check.message))
        if check.remedy:
            table.add_row("", "", Text(f"→ {check.remedy}", "dim" if check.verdict == "ok" else ""))
    # A file or a pipe has no width to keep to.
    terminal.console(width=None if terminal.is_terminal() else 1 << 14).print(table)
