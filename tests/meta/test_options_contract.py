"""Every option and key is on a page and set by a test; --json is on every command (test_errors_contract.py)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer

from livebode.cli.app import app
from livebode.configuration import axis_schema
from livebode_design.experiment_schema import experiment_schema, matrix_experiment_schema
from livebode_plant.archive.archive_settings import archive_schema
from livebode_plant.fleet.fleet_settings import FleetSettings

ROOT = Path(__file__).parents[2]
PAGES = ("README.md", "docs/**/*.md", "wings/*/docs/*.md")
TESTS = ("tests/**/*.py", "wings/*/tests/**/*.py")


def texts(patterns: tuple[str, ...]) -> list[str]:
    paths = {path for pattern in patterns for path in ROOT.glob(pattern) if path.name != "command-line.md"}
    return [path.read_text("utf-8") for path in paths]


def options() -> Iterator[tuple[str, tuple[str, ...]]]:
    """Command and names of each option."""
    commands: dict[str, Any] = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    for outer, group in commands.items():
        for name, command in getattr(group, "commands", {outer: group}).items():
            for one in command.params:
                if one.param_type_name == "option" and one.name != "as_json":
                    yield name, (*one.opts, *one.secondary_opts)


def absent(patterns: tuple[str, ...], command: str) -> set[tuple[str, str]]:
    """Options that no file names together with their command."""
    found = texts(patterns)
    of = {name: [text for text in found if re.search(command.format(name), text)] for name, _ in options()}
    patterns_of = [(name, names[0], "|".join(rf"{one}(?![\w-])" for one in names)) for name, names in options()]
    return {(name, option) for name, option, one in patterns_of if not any(re.search(one, text) for text in of[name])}


def test_every_option_is_on_a_page_of_its_command_and_set_by_a_test() -> None:
    assert absent(PAGES, r"(`|livebode |archive |fleet ){}\b") == set()
    assert absent(TESTS, '[" ]{}[" ]') == set()


def test_every_key_of_a_file_is_on_a_page_and_set_by_a_test() -> None:
    schemas = (axis_schema(), experiment_schema(), matrix_experiment_schema(), archive_schema())
    every = [
        part for schema in (*schemas, FleetSettings.model_json_schema()) for part in (schema, *schema["$defs"].values())
    ]
    keys = {key for part in every for key in part.get("properties", {})}
    assert len(keys) > 250
    for patterns in (PAGES, TESTS):
        words = {word for text in texts(patterns) for word in re.findall(r"\w+", text)}
        assert keys - words == set()
