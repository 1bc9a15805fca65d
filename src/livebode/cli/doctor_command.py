"""`livebode doctor`: what is right and wrong with this computer and a configuration."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from livebode.cli import terminal
from livebode.cli.options import Json

if TYPE_CHECKING:
    from livebode.doctor import Check

_TABLE_COLUMNS = 80  # of a terminal; in a narrower one a table has no room for a sentence
_STYLES = {"not applicable": "dim", "ok": "green", "warning": "yellow", "failed": "bold red"}


def doctor_command(
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
    force: Annotated[bool, typer.Option("--force", help="Replace an earlier bundle.")] = False,
    as_json: Json = False,
) -> None:
    """Check this computer, a configuration and whether its machine can be reached.

    Exit code 2 where a check failed. No data is changed; a connection is opened and closed.
    """
    from livebode.doctor import Subject, examine, worst, write_bundle  # with the dashboard and the simulation
    from livebode.records import to_json

    subject = Subject.of(targets or [])
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
