"""A short version of each study runs, draws and writes; its verdicts say what was measured."""

from __future__ import annotations

import json
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from livebode.simulation import Mechanics
from studies import STUDIES
from studies.__main__ import main, write
from studies.common import Local, error_db, lines, rms, stroke, track, within_stroke
from studies.fig8_9 import held_from
from studies.page import write_page
from studies.result import Result, Study, Verdict

ROOT = Path(__file__).parents[2]
FROZEN = Mechanics(frozen_position_m=0.8)
NAMES = [study.name for study in STUDIES]


@cache
def short(name: str) -> tuple[Study, Result]:
    study = next(study for study in STUDIES if study.name == name)
    return study, study.measure(True)


@pytest.mark.parametrize("name", NAMES)
def test_a_short_version_runs_draws_and_writes(name: str, tmp_path: Path) -> None:
    study, result = short(name)
    write(study, result, tmp_path)
    assert (tmp_path / f"{name}.png").stat().st_size > 20_000
    numbers = json.loads((tmp_path / f"{name}.json").read_text())
    for table in numbers["tables"]:
        assert table["rows"]
        for row in table["rows"]:
            assert len(row) == len(table["header"])
            assert all(isinstance(cell, str) or math.isfinite(cell) for cell in row), row
    write_page(STUDIES, tmp_path, tmp_path / "page.md")
    page = " ".join((tmp_path / "page.md").read_text().split())
    assert study.title in page
    assert study.paper in page
    for verdict in result.verdicts:
        assert math.isfinite(verdict.value)
        assert f"**{verdict.word}** {verdict.claim}" in page


@pytest.mark.parametrize("name", NAMES)
def test_the_committed_page_is_that_of_the_committed_numbers(name: str, tmp_path: Path) -> None:
    assert (ROOT / "docs" / "images" / "studies" / f"{name}.png").exists()
    write_page(STUDIES, ROOT / "docs" / "images" / "studies", tmp_path / "page.md")
    assert (tmp_path / "page.md").read_text() == (ROOT / "docs" / "explanation" / "studies.md").read_text()


@pytest.mark.parametrize(
    ("value", "at_least", "word"),
    [
        (1.0, False, "met"),
        (1.1, False, "missed"),
        (1.0, True, "met"),
        (0.9, True, "missed"),
    ],
)
def test_a_verdict_is_met_or_missed_by_the_side_of_the_target(value: float, at_least: bool, word: str) -> None:
    verdict = Verdict("claim", value, 1.0, at_least, why="the reason")
    assert verdict.word == word
    assert str(verdict).startswith(word)
    assert ("the reason" in str(verdict)) == (word != "met")
    assert Verdict("claim", math.nan, 1.0).word == "missed"


def test_an_unknown_study_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fig99"]) == 2
    assert "fig8_9" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("errors", "words"),
    [([9, 9, 9, 1, 9, 1, 1], "from 0.4 s on"), ([1] * 7, "everywhere"), ([1] * 6 + [9], "nowhere")],
)
def test_targets_hold_from_where_none_is_missed_later(errors: list[float], words: str) -> None:
    assert held_from([(errors, 2.0), ([9.0] * 7, None), ([1.0] * 7, 2.0)]) == words


def test_the_error_of_a_frozen_machine_long_after_the_start_is_none() -> None:
    """The measure of error itself: a linear machine far from accelerations has no error but its noise."""
    truth = Local()
    direct = stroke(sigma=0.0).axis.linear(0.777).sampled(4000.0).response(lines().frequency_hz)
    assert np.allclose(truth(np.array([0.777]))[0], direct, rtol=1e-6)
    recording = stroke(sigma=0.0, mechanics=FROZEN)
    found = within_stroke(track(recording.block), recording)
    assert found.first[0] >= recording.first
    assert found.sample[-1] <= recording.last
    errors = error_db(found, Local(FROZEN)(found.schedule))
    assert rms(errors[(found.schedule > 1.0) & (found.schedule < 1.5)]) < 0.01
