"""The analyses of a run in Python give what the commands give."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from livebode import Run
from livebode.records import to_json
from tests.support.command import livebode


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run whose controllers are described, and one of strokes."""
    folder = tmp_path_factory.mktemp("runs")
    for name in ("tune", "moving"):
        assert livebode("example", name, "--out", folder).code == 0
        assert livebode("run", folder / f"{name}.toml", "--out", folder / name).code == 0
    return folder


@pytest.mark.parametrize(
    ("run", "analysis", "options", "command"),
    [
        ("tune", "loop-check", {}, ["validate", "--loop"]),
        ("tune", "proposal", {"loop_checked": True}, ["tune", "--loop-checked"]),
        ("moving", "friction", {"places": 3}, ["friction", "--places", "3"]),
        ("moving", "orders", {}, ["orders"]),
    ],
)
def test_an_analysis_is_that_of_its_command(
    runs: Path, run: str, analysis: str, options: dict[str, Any], command: list[str]
) -> None:
    done = livebode(command[0], runs / run, *command[1:], "--json")
    assert done.code == 0, done.err
    found = json.loads(to_json(Run(runs / run).analysis(analysis)(**options).plain()))
    printed = json.loads(done.out)
    assert found == {key: printed[key] for key in found}
