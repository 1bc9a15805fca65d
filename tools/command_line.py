"""`python -m tools.command_line > docs/reference/command-line.md`: the page of commands, from Typer."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator
from typing import Any

import typer

from livebode.cli.app import app

HEAD = """# Command line

`livebode COMMAND --help` prints the same. Exit codes: 0 success, 1 internal error, 2 wrong as it is, such as an option,
3 no model fits, 4 a limit is not met (`report --check`), 75 what may pass, such as a full disk; 128 + n: stopped by
signal n. [Errors](errors.md) have a code, and `--json` prints them in machine-readable form.
"""


def page() -> str:
    """The page in Markdown."""
    commands: dict[str, Any] = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    return "\n".join([HEAD, *(text for name, command in commands.items() for text in _sections(name, command))])


def _sections(name: str, command: Any) -> Iterator[str]:
    yield _section(name, command)
    for inner, one in getattr(command, "commands", {}).items():
        yield _section(f"{name} {inner}", one)


def _section(name: str, command: Any) -> str:
    context = typer.Context(command, info_name=name)
    usage = " ".join(command.collect_usage_pieces(context))
    records = [parameter.get_help_record(context) for parameter in command.params]
    rows = [f"| `{_cell(names)}` | {_cell(text)} |" for names, text in filter(None, records)]
    table = "\n".join(["", "| argument or option | meaning |", "|---|---|", *rows, ""]) if rows else ""
    return f"## livebode {name}\n\n    livebode {name} {usage}\n\n{_paragraphs(command.help)}\n{table}"


def _paragraphs(text: str) -> str:
    paragraphs = [" ".join(paragraph.split()) for paragraph in text.split("\n\n")]
    return "\n\n".join(textwrap.fill(paragraph, 120, break_on_hyphens=False) for paragraph in paragraphs)


def _cell(text: str) -> str:
    return re.sub(r"(?<!\\)\|", r"\\|", " ".join(text.replace("\\[", "[").split()))


if __name__ == "__main__":
    print(page(), end="")
