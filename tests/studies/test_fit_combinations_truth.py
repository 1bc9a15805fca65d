"""Bounds where two effects are missing: short form of `python -m studies.fit_combinations`."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.fitting import EvaluationGrid, TwoMass, fit
from livebode.fitting.extended import LAG, MODE, ExtendedModel
from studies.fit_combinations import RADIUS_M, machine, measure, measured, sets, true_margins

RUNS = 3


def test_every_two_effects_are_one_set() -> None:
    assert len(list(sets("two"))) == 10
    assert len(list(sets("all"))) == 16


@pytest.mark.parametrize("effects", [("lag", "friction"), ("delay", "further mode")], ids="+".join)
def test_most_bounds_cover_where_two_effects_are_missing(effects: tuple[str, ...]) -> None:
    found = measure(effects, RUNS, 0)
    print(found)
    # Of 12 bounds that cover with 90 %, 8 or more do but for one time in 230.
    assert found.covered[:4].sum() * found.complete >= 2 / 3 * 4 * found.complete
    assert found.complete >= 1


def test_the_machine_of_the_study_is_the_model_with_its_effects() -> None:
    """Lag, friction and delay by matrix exponentials and by the fitted model's poles."""
    of = machine(("lag", "friction"), 5)
    lag = -1 / of.a[-1, -1]
    js, load, stiffness, damping = of.truth
    frictions = -of.a[0, 0] - damping * RADIUS_M**2 / js, -of.a[1, 1] - damping / load
    base = TwoMass(radius_m=RADIUS_M)
    model = ExtendedModel(base, (LAG,), 140.0)
    values = [js, load, stiffness, damping, frictions[0] * js, frictions[1] * load, of.delay_s, lag]
    f = of.lines.frequency_hz
    assert np.allclose(model.at(values, EvaluationGrid.of(of.lines)), of.response(f), rtol=1e-6)


def test_margins_beyond_the_lines_contain_what_no_line_shows() -> None:
    of = machine(("lag", "delay"), 3)
    found = fit(measured(of, 3), TwoMass(radius_m=RADIUS_M))
    wide = found.with_unseen()
    assert set(found.model.names) <= set(wide.model.names)
    assert wide.model.name == found.model.name  # what is not shown is not named
    assert [row[0] for row in wide.rows()][: len(found.rows())] == [row[0] for row in found.rows()]
    assert true_margins(of) is not None


def test_a_further_mode_that_the_lines_show_is_named() -> None:
    of = machine(("further mode",), 0)
    found = fit(measured(of, 0), TwoMass(radius_m=RADIUS_M))
    assert MODE in found.taken or "residual compliance" in found.taken
