"""What the pages show besides programs: TOML is a configuration, options exist, also of commands that no test runs.

Commands and Python run in test_pages_run.py, the cells of the tutorials in a test of their own; the C of
docs/reference/kernel.md is compiled by a test of the kernel.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import typer

from livebode.cli.app import app
from livebode.configuration import Axis, tables_of
from livebode.configuration.axes import merged
from livebode_design import Experiment, MatrixExperiment
from livebode_design.matrix.matrix_experiment import TABLES
from livebode_plant.archive.archive_settings import ArchiveSettings
from livebode_plant.fleet.fleet_settings import FleetSettings
from tests.support.pages import PAGES, ROOT, steps_of

ARCHIVE = {"inputs": ["*.csv"], "recipe": "recipe.toml", "lake": "lake"}
SMALLEST = {"source": {"log": "log.parquet"}, "signals": {"output": "y", "input": "u", "excitation": "w"}}


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


def toml_of(page: Path) -> list[str]:
    return re.findall(r"^```toml\n(.*?)^```$", page.read_text("utf-8"), re.M | re.S)


TOML = [pytest.param(text, id=f"{name_of(page)}-{n}") for page in PAGES for n, text in enumerate(toml_of(page))]


@pytest.mark.parametrize("text", TOML)
def test_the_toml_of_a_page_is_a_configuration(text: str) -> None:
    """Alone where it has signals, otherwise with the smallest configuration around it."""
    data = tomllib.loads(text)
    if data.keys() & {"inputs", "cluster"}:
        assert ArchiveSettings.model_validate(ARCHIVE | data)
        return
    if isinstance(data.get("axes"), list):
        assert FleetSettings.of(data, "fleet.toml")
        return
    if data.keys() & set(TABLES):
        drives = {} if "measured_matrix" in data else {"drives": {"noise": 0.1}}
        assert MatrixExperiment.of({"excitation": {}} | drives | data, "experiment.toml").machine_limits()
        return
    if "excitation" in data:
        assert Experiment.of(data, "experiment.toml")
        return
    below = {} if "signals" in data else SMALLEST | ({"source": {}} if "source" in data else {})
    for table in tables_of(merged(below, data), "axis.toml").values():
        assert Axis.of(table, "axis.toml")


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_commands_of_a_page_and_their_options_exist(page: Path) -> None:
    group: Any = typer.main.get_command(app)
    for step in steps_of(page):
        if step.python or step.words[0] != "livebode":
            continue
        words = [word.partition("=")[0] for word in step.words[1:]]
        command = next((group.commands[word] for word in words if word in group.commands), group)
        inner = getattr(command, "commands", {})
        command = next((inner[word] for word in words if word in inner), command)
        known = {name for options in (group, command) for parameter in options.params for name in parameter.opts}
        assert command is not group or words == ["--help"], step.text
        assert {word for word in words if re.match("--?[a-z]", word)} <= known, step.text
