"""docs/recordings.md: every command runs, on files of every kind, and a run gives the machine that is in them."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from livebode.records import RunRecord
from tests.support.command import livebode
from tests.support.strangers import write_all

PAGE = (Path(__file__).parents[2] / "docs/recordings.md").read_text("utf-8")
COMMANDS = [
    line.removeprefix("$ livebode ")
    for block in re.findall(r"^```console\n(.*?)^```$", PAGE, re.M | re.S)
    for line in block.splitlines()
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recordings")
    write_all(folder)
    return folder


def test_the_page_names_each_kind_of_file(folder: Path) -> None:
    named = {shlex.split(command)[1] for command in COMMANDS}
    assert named == {path.name for path in folder.iterdir()} - {"drive.dbc", "runs"}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_page_runs_and_gives_the_gain_of_the_machine(
    command: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    words = shlex.split(command)
    result = livebode(*words)
    assert (result.code, result.err) == (0, "")
    for name in words[3::2] if words[0] == "inspect" else ():
        assert name in result.out
    if words[0] == "run":
        last = RunRecord.open(Path(words[-1])).responses()[-1]
        # 2 of the unit of the output per A; mm/s are read as m/s.
        gain = 2e-3 if last.unit.startswith("m/s") else 2
        assert np.abs(last.value) == pytest.approx(gain, rel=0.05)
