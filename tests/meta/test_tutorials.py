"""The tutorials: every cell runs, and so do the checks in them. `make docs` runs the same cells in a notebook."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import pytest

from livebode.cli.app import app

FOLDER = Path(__file__).parents[2] / "docs" / "tutorials"
TUTORIALS = sorted(page for page in FOLDER.glob("*.md") if page.stem != "index")
CELL = re.compile(r"^```\{code-cell\}\n((?::[^\n]*\n)*)(.*?)^```$", re.M | re.S)


def run_command(command: str) -> None:
    """A line `!livebode …` of a cell, in this process."""
    app(shlex.split(command), standalone_mode=False)


def as_python(cell: str) -> str:
    """The cell with its commands as calls."""
    return re.sub(r"^!livebode (.*)$", lambda line: f"run_command({line.group(1)!r})", cell, flags=re.M)


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_every_cell_of_a_tutorial_runs_and_its_checks_hold(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    matplotlib.use("Agg")
    cells = [cell for _, cell in CELL.findall(page.read_text("utf-8"))]
    assert any("assert " in cell for cell in cells), "a tutorial checks what it states"
    names: dict[str, Any] = {"run_command": run_command}
    try:
        for number, cell in enumerate(cells, 1):
            exec(compile(as_python(cell), f"{page.name}, cell {number}", "exec", dont_inherit=True), names)
    finally:
        plt.close("all")
