"""Every command, option and key that a sentence of the package names exists: from its source, the commands, the models.

That advice works too is tested in tests/cli/test_advice_contract.py, where a situation can be made.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from livebode.cli.app import app
from livebode.configuration import axis_schema
from livebode.plugins import named
from livebode_design.experiment_schema import experiment_schema, matrix_experiment_schema
from livebode_plant.archive.archive_settings import archive_schema
from livebode_plant.fleet.fleet_settings import FleetSettings
from tests.support.sentences import literals, made, templates, text_of

COMMAND = re.compile(r"\blivebode ((?:[a-z]+(?:-[a-z]+)*)(?: [a-z]+)?)([^`;()]*)")
OPTION = re.compile(r"(?<![\w-])--[a-z]+(?:-[a-z]+)*\b")
KEY = re.compile(r"(?<![\w./'-])([a-z_]+)\.([a-z_]+)\b(?![(/.])")
SECTION = re.compile(r"\[\[?([a-z_]+)(?:\.[a-z_]+)?\]\]?")
PROSE = {"after", "and", "can", "cannot", "computed", "could", "did", "first", "listen", "on", "reads", "that", "wrote"}
"""Words that follow the name of the program in a sentence about it."""

ELSEWHERE = {
    ("cli/inspect_command.py", "--estimator"): "the sentence is about the run that follows",
    ("cli/inspect_command.py", "--output-only"): "of run, friction and orders, which the sentence names",
    ("cli/configuration_dialog.py", "--output-only"): "of the command line of run that is composed of it",
    ("core/optional_packages.py", "--editable"): "of pip",
}
"""Options that do not belong to the command whose module names them, and why."""
ATTRIBUTES = {("loop", "feedback"), ("loop", "entry")}
"""Of the argument of a function, which is named like a section."""
FILES = {"npz", "toml", "json", "jsonl"}
"""Endings of names of files that begin as a section is called."""
UNITS = {"us"}


COMMANDS = named("commands")
GROUPS = {name: command.commands for name, command in COMMANDS.items() if command.commands}


@cache
def options() -> Mapping[str, frozenset[str]]:
    """The options by command, such as "fit" or "archive run"; "" has those of the program itself."""
    import click
    import typer

    program: Any = typer.main.get_command(app)
    names = [name for name in named("commands") if name not in GROUPS]
    given = {"": frozenset(o for p in program.params for o in p.opts) | {"--help", "--version"}}
    for name, command in [(name, program.commands[name]) for name in names] + [
        (f"{group} {name}", program.commands[group].commands[name]) for group in GROUPS for name in GROUPS[group]
    ]:
        context = click.Context(command, info_name=name)
        parameters = command.get_params(context)
        given[name] = frozenset(o for p in parameters for o in (*p.opts, *p.secondary_opts) if o.startswith("--"))
    return given


@cache
def sections() -> Mapping[str, frozenset[str]]:
    """The keys by section of all configuration files, together."""
    found: dict[str, frozenset[str]] = {}
    schemas = axis_schema(), experiment_schema(), matrix_experiment_schema(), archive_schema()
    for schema in (*schemas, FleetSettings.model_json_schema()):
        for section, part in schema["properties"].items():
            found[section] = found.get(section, frozenset()) | frozenset(keys_of(part, schema))
    return {section: keys for section, keys in found.items() if keys}


def keys_of(part: Mapping[str, Any], schema: Mapping[str, Any]) -> Iterator[str]:
    if "$ref" in part:
        yield from keys_of(schema["$defs"][part["$ref"].rpartition("/")[2]], schema)
    yield from part.get("properties", ())
    for inner in (*part.get("anyOf", ()), *part.get("oneOf", ()), *part.get("allOf", ())):
        yield from keys_of(inner, schema)
    for inner in (part.get("items"), part.get("additionalProperties")):
        if isinstance(inner, dict):
            yield from keys_of(inner, schema)


def named_commands(text: str) -> Iterator[tuple[str, str]]:
    """The commands that a text names, and what follows each; the name of a thread or file is no sentence."""
    for found in COMMAND.finditer(text):
        first, _, second = found[1].partition(" ")
        if first not in PROSE and found[0].strip() != text:
            name = f"{first} {second}" if first in GROUPS else first
            yield name.strip(), found[2]


def commands_of(path: Path) -> list[str]:
    """The command in the module of one; all in others."""
    name = path.stem.removesuffix("_command").replace("_", "-")
    own = f"{path.parent.name} {name}" if path.parent.name in GROUPS else name
    return [own] if "cli" in path.parts and path.stem.endswith("_command") and own in options() else [*options()]


def test_every_command_that_a_sentence_names_exists() -> None:
    found_names = [(path, line, name) for path, line, text in literals() for name, _ in named_commands(text)]
    assert len(found_names) > 40
    assert [found for found in found_names if found[2] not in {*options(), *GROUPS}] == []


def test_every_option_that_a_sentence_names_is_one_of_the_command_that_it_belongs_to() -> None:
    wrong, checked = [], 0
    for path, line, text in literals():
        if "livebode_reports" in path.parts and "{" in text:  # a style sheet has --variables
            continue
        after = {option: name for name, rest in named_commands(text) for option in OPTION.findall(rest)}
        for option in OPTION.findall(text):
            names = [after[option]] if option in after else commands_of(path)
            checked += 1
            if (str(path), option) in ELSEWHERE:
                continue
            if not any(option in options()[name] for name in names if name in options()):
                wrong.append((str(path), line, option, names[:2]))
    assert checked > 150
    assert wrong == []


def test_every_key_and_section_that_an_error_or_event_names_exists() -> None:
    said = [(where, text_of(node)) for where, _, call in made() for node in ast.walk(call)]
    said += [("a message", text) for text in templates()]
    keys = [(where, *found.groups()) for where, text in said for found in KEY.finditer(text) if found[2] not in FILES]
    known = [
        (where, section, key)
        for where, section, key in keys
        if section in sections() and (section, key) not in ATTRIBUTES
    ]
    assert len(known) > 100
    assert [found for found in known if found[2] not in sections()[found[1]]] == []
    tables = [(where, found[1]) for where, text in said for found in SECTION.finditer(text) if found[1] not in UNITS]
    assert len(tables) > 20
    assert [found for found in tables if found[1] not in sections()] == []


@pytest.mark.parametrize("wrong", ["use `livebode fits RUN`", "see `livebode fit RUN --modle modal`"])
def test_a_wrong_name_would_be_found(wrong: str) -> None:
    ((name, rest),) = named_commands(wrong)
    assert name not in options() or not set(OPTION.findall(rest)) <= options()[name]
