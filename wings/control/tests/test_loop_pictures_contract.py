"""Pictures of a loop and of a validation: the same bytes each time, light and dark, also without margins."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from livebode.analysis import Margins, OpenLoop, margins
from livebode.core import Block, Responses
from livebode.fitting import EvaluationGrid, Fit, fit
from livebode_control.margins.loop_picture import save_loop_picture
from livebode_control.validation.validation import validate
from livebode_control.validation.validation_picture import save_validation_picture
from tests.support.belt_loops import LINES, responses_of
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


@pytest.mark.parametrize(("case", "dark"), [(SHARP, False), (SHARP, True), (UNSTABLE, False)])
def test_a_loop_gives_the_same_picture_again(case: Case, dark: bool, tmp_path: Path) -> None:
    """The last one is unstable: a picture without margins."""
    seen = [save_loop_picture(found(case), tmp_path, title="axis", dark=dark).read_bytes() for _ in range(2)]
    assert seen[0] == seen[1]
    assert len(seen[0]) > 20_000


@pytest.mark.parametrize("dark", [False, True])
def test_a_validation_gives_the_same_picture_again(dark: bool, tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    u = rng.standard_normal(1000)
    block = Block(np.array([u, np.cumsum(u) + rng.standard_normal(1000)]), ("u", "y"), 4000.0)
    model = found(Case(BELT)).fit
    one = validate(model, block, input="u", output="y")
    seen = [save_validation_picture([one, one], tmp_path, dark=dark).read_bytes() for _ in range(2)]
    assert seen[0] == seen[1]
    assert len(seen[0]) > 20_000
