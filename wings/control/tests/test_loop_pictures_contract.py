"""Pictures of a loop and of a validation: the same bytes each time, with their numbers, also without margins."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from livebode.analysis import Margins, OpenLoop, margins
from livebode.core import Block, Responses
from livebode.fitting import EvaluationGrid, Fit, fit
from livebode.pictures import Dots
from livebode_control.margins.loop_picture import loop_figure, save_loop_picture
from livebode_control.validation.validation import validate
from livebode_control.validation.validation_picture import save_validation_picture, validation_figure
from tests.support.belt_loops import LINES, responses_of
from tests.support.drawn_svg import checked, paths_of
from tools.loops import BELT, MODEL, Case, parameters


@dataclass(frozen=True)
class Found:
    fit: Fit
    loop: OpenLoop
    margins: Margins
    responses: Responses


def found(case: Case) -> Found:
    truth = MODEL.at(parameters(BELT[np.newaxis]).value[0], EvaluationGrid.of(LINES))
    measured = responses_of(truth, 0.05, 1, seed=1)
    model = fit(measured, MODEL)
    return Found(model, case.open, margins(model.parameters, case.open, model.band_hz), measured)


SHARP, UNSTABLE = Case(BELT, gain=0.7, delay_ticks=8), Case(BELT, gain=4.6, delay_ticks=12)


@pytest.mark.parametrize("case", [SHARP, UNSTABLE], ids=["stable", "unstable"])
def test_a_loop_gives_the_same_picture_again(case: Case, tmp_path: Path) -> None:
    """The last one is unstable: a picture without margins."""
    seen = [save_loop_picture(found(case), tmp_path, title="axis").read_text("utf-8") for _ in range(2)]
    assert seen[0] == seen[1]
    assert paths_of(checked(seen[0]), "fit")


def test_the_measured_lines_are_on_the_open_loop_of_the_truth() -> None:
    one = found(SHARP)
    figure = loop_figure(one)
    magnitude, phase, nyquist = (mark for mark in figure.marks("measured") if isinstance(mark, Dots))
    truth = MODEL.at(parameters(BELT[np.newaxis]).value[0], EvaluationGrid.of(LINES))
    loop = truth * SHARP.open.loop.feedback_at(LINES.frequency_hz)
    np.testing.assert_allclose(10 ** (magnitude.y / 20), np.abs(loop), rtol=0.5)
    np.testing.assert_allclose(nyquist.x**2 + nyquist.y**2, 10 ** (magnitude.y / 10))
    turned = (nyquist.x + 1j * nyquist.y) / 10 ** (magnitude.y / 20)
    np.testing.assert_allclose(np.exp(1j * np.radians(phase.y)), turned)


def test_a_validation_gives_the_same_picture_again(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    u = rng.standard_normal(1000)
    block = Block(np.array([u, np.cumsum(u) + rng.standard_normal(1000)]), ("u", "y"), 4000.0)
    model = found(Case(BELT)).fit
    one = validate(model, block, input="u", output="y")
    seen = [save_validation_picture([one, one], tmp_path).read_text("utf-8") for _ in range(2)]
    assert seen[0] == seen[1]
    assert len(paths_of(checked(seen[0]), "measured")) == 2
    figure = validation_figure([one])
    np.testing.assert_array_equal(figure.marks("simulated")[0].y, one.simulated.output[-600:])
