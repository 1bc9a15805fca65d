"""[machine]: who the machine is, by levels; several axes of one file; reports and the list of runs know it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from livebode.configuration import Axis, MachineSection, axes_of, recipe_id, recorded_report
from livebode.core import LEVELS, ConfigError, RecordError
from livebode.dashboard.run_entry import RunEntry, entry
from tests.support.errors import refused
from tests.support.many_runs import source_run
from tools.run_copies import copy_run

AXIS = '[source]\nlog = "a.csv"\n[signals]\noutput = "y"\n'
GANTRY = """
[machine]
site = "Graz"
line = "2"
machine = "gantry"
"""
AXES = """
[signals]
output = "y"
[axes.x.source]
log = "x.csv"
[axes.z.source]
log = "z.csv"
"""
GRIPPER = """
[axes.z.machine]
machine = "gripper"
axis = "Z 1"
"""
NAMES = st.text(st.characters(exclude_characters="/", exclude_categories=("C", "Z")), max_size=9)


def axes_in(text: str) -> dict[str, Axis]:
    return axes_of(text.encode(), Path("axis.toml"), {})


def path_of(axis: Axis) -> str:
    return "" if axis.machine is None else axis.machine.path


@given(st.lists(NAMES, min_size=4, max_size=4))
def test_the_path_has_the_levels_that_have_a_name_in_their_order(names: list[str]) -> None:
    given_names = dict(zip(LEVELS, names))
    section = MachineSection(**given_names)
    assert section.levels == {level: name for level, name in given_names.items() if name}
    assert section.path == "/".join(filter(None, names))
    assert [*section.levels] == [level for level in LEVELS if level in section.levels]


def test_each_axis_of_a_file_has_a_path_of_its_own() -> None:
    axes = axes_in(GANTRY + AXES + GRIPPER)
    assert {name: path_of(axis) for name, axis in axes.items()} == {"x": "Graz/2/gantry/x", "z": "Graz/2/gripper/Z 1"}
    assert {path_of(axis) for axis in axes_in(AXES).values()} == {""}
    assert path_of(axes_in(AXIS)[""]) == ""


@pytest.mark.parametrize("name", ["a/b", " a", "a ", "a\tb", "x" * 81])
def test_a_name_that_is_not_a_level_is_refused_with_its_key(name: str) -> None:
    with refused(ConfigError, "value-invalid", key="machine.site"):
        axes_in(AXIS + f'[machine]\nsite = "{name}"\n'.replace("\t", "\\t"))


def test_another_key_is_refused_with_the_nearest_one() -> None:
    with pytest.raises(ConfigError, match="did you mean 'machine'"):
        axes_in(AXIS + '[machine]\nmachin = "press"\n')


def test_the_machine_does_not_change_the_recipe() -> None:
    named = axes_in(AXIS + '[machine]\nmachine = "press"\n')[""]
    assert recipe_id(named) == recipe_id(axes_in(AXIS)[""])


@pytest.mark.parametrize(
    ("sections", "machine"),
    [
        ({"machine": {"site": "Graz", "line": "", "machine": "press", "axis": "X"}}, "Graz/press/X"),
        ({"machine": {"machine": "press"}, "report": {"machine": "LX-200"}}, "LX-200"),
        ({"machine": None, "report": {"machine": ""}}, ""),
        ({}, ""),
    ],
)
def test_a_report_names_the_machine_by_its_path_unless_it_has_a_name(sections: dict[str, Any], machine: str) -> None:
    assert recorded_report({"configuration": sections}).machine == machine


def test_a_recorded_machine_in_another_form_is_refused() -> None:
    with refused(RecordError, "unexpected-content", key="machine.site"):
        recorded_report({"configuration": {"machine": {"site": 4}}})


def test_the_list_of_runs_has_the_path_and_its_search_finds_it(tmp_path: Path) -> None:
    source = source_run()

    def row(name: str, **sections: Any) -> RunEntry:
        copy_run(source, tmp_path / name, changes={"configuration": sections})
        return entry(tmp_path / name)

    found = row("named", machine={"site": "Graz", "machine": "press 4", "axis": "X"}, report={"machine": "LX-200"})
    assert found.machine == "Graz/press 4/X"
    assert "LX-200" in found.words
    assert row("reported", report={"machine": "LX-200", "serial_number": "7"}).machine == "LX-200 · 7"
    assert row("damaged", machine={"site": ["a"], "axis": 4}).machine == ""
