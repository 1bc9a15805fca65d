"""Every option is on a page and set by a test; --json is on every command (tests/cli/test_errors_contract.py)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer

from livebode.cli.app import app

ROOT = Path(__file__).parents[2]


def options() -> Iterator[tuple[str, tuple[str, ...]]]:
    """Command and names of each option."""
    commands: dict[str, Any] = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    for outer, group in commands.items():
        for name, command in getattr(group, "commands", {outer: group}).items():
            for one in command.params:
                if one.param_type_name == "option" and one.name != "as_json":
                    yield name, (*one.opts, *one.secondary_opts)


def absent(command: str, *patterns: str) -> set[tuple[str, str]]:
    """Options that no file names together with their command."""
    paths = {path for pattern in patterns for path in ROOT.glob(pattern) if path.name != "command-line.md"}
    texts = [path.read_text("utf-8") for path in paths]
    of = {name: [text for text in texts if re.search(command.format(name), text)] for name, _ in options()}
    patterns_of = [(name, names[0], "|".join(rf"{one}(?![\w-])" for one in names)) for name, names in options()]
    return {(name, option) for name, option, one in patterns_of if not any(re.search(one, text) for text in of[name])}


def test_every_option_is_on_a_page_of_its_command_and_set_by_a_test() -> None:
    assert absent(r"(`|livebode |archive |fleet ){}\b", "README.md", "docs/**/*.md", "wings/*/docs/*.md") == set()
    assert absent('[" ]{}[" ]', "tests/**/test_*.py", "wings/*/tests/**/test_*.py") == set()
