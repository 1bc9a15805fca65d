"""The first page of help and the completion know the commands and options of the application without loading them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer

import livebode as package
from livebode.cli.app import app
from livebode.cli.commands import PANELS, panels
from livebode.cli.first_page import ABOUT, OPTIONS, first_page
from livebode.plugins import named
from tests.support.command import livebode

COMMANDS = named("commands")
PROGRAM = str(Path(sys.executable).with_name("livebode"))


@pytest.fixture(scope="module")
def group() -> Any:
    return typer.main.get_command(app)


def test_the_page_has_the_first_paragraph_of_the_help_of_every_command(group: Any) -> None:
    found = {name: " ".join(command.help.split("\n\n")[0].split()) for name, command in group.commands.items()}
    assert {name: command.summary for name, command in named("commands").items()} == found
    assert group.help == ABOUT


def test_the_page_has_every_option_of_the_application_with_its_help(group: Any) -> None:
    options = {option: parameter for parameter in group.get_params(typer.Context(group)) for option in parameter.opts}
    listed = {name.split()[0]: text for name, text in OPTIONS.items()}
    assert listed.keys() == options.keys()
    assert all(text.startswith(options[name].help.replace("\\[", "[").rstrip(".")) for name, text in listed.items())


@pytest.mark.parametrize("width", [1, 40, 79, 200])
def test_the_page_fits_the_terminal_and_loses_no_word(width: int) -> None:
    page = first_page(width, colours=False)
    framed = [line for line in page.splitlines() if line[:1] in tuple("╭│╰")]
    assert {len(line) for line in framed} == {max(width, 40)}
    wanted = " ".join([*OPTIONS.values(), *(command.summary for command in named("commands").values())]).split()
    assert sorted(set(wanted) - set(page.replace("│", " ").split())) == []


def test_the_page_has_five_panels_with_every_command_of_livebode_in_one() -> None:
    by_panel = panels(COMMANDS)
    assert tuple(by_panel) == PANELS
    assert sorted(name for rows in by_panel.values() for name, _ in rows) == sorted(COMMANDS)
    page = first_page(80, colours=False)
    assert re.findall("─ ([^─]+) ─", page) == ["Options", *PANELS]
    asked = livebode("--log-level", "info", "--help").out
    assert re.findall("[-─] ([A-Z][^-─]+) [-─]", asked) == ["Options", *PANELS]


def test_colours_add_nothing_but_colours() -> None:
    coloured = first_page(80, colours=True)
    for style in ("\x1b[1m", "\x1b[2m", "\x1b[1;33m", "\x1b[1;36m", "\x1b[0m"):
        assert style in coloured
        coloured = coloured.replace(style, "")
    assert coloured == first_page(80, colours=False)


def test_help_is_a_success_and_no_arguments_are_a_usage_error_with_the_same_page() -> None:
    asked, empty, version = livebode("--help"), livebode(), livebode("--version")
    assert (asked.code, empty.code, version.code) == (0, 2, 0)
    assert asked.out == empty.out
    assert version.out == f"livebode {package.__version__}\n"


def test_a_page_that_cannot_be_printed_is_reported() -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run([PROGRAM, "--help"], stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 75
    assert done.stderr.startswith("livebode: ")
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("typed", "wanted"),
    [("livebode ", set(named("commands"))), ("livebode doctor --js", {"--json"})],
)
def test_a_shell_completes_commands_and_their_options(typed: str, wanted: set[str]) -> None:
    asked = {"_LIVEBODE_COMPLETE": "complete_bash", "COMP_WORDS": typed, "COMP_CWORD": str(typed.count(" "))}
    done = subprocess.run([PROGRAM], env=os.environ | asked, capture_output=True, text=True)
    assert wanted <= set(done.stdout.split())
