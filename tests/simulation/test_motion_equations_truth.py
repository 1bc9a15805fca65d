"""The simulated motion against solve_ivp at tight tolerance, over a stroke, from the equations alone."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.simulation import Backlash, BeltAxis, Friction, Mechanics, SimulatedAxis, Strokes
from tests.support.axes import MULTISINE, fast_stroke
from tools.motion_equations import stroke_error


@pytest.mark.parametrize("masses", [2, 3])
def test_a_fast_stroke_follows_the_equations_of_motion_by_another_method(masses: int) -> None:
    # RK45 shares no coefficient with the simulation, but takes many more steps.
    assert stroke_error(masses, False, "RK45", fast_stroke(dwell_s=0.02)) < 1e-8


@pytest.mark.parametrize("masses", [2, 3])
@pytest.mark.parametrize(
    "options",
    [{"friction": Friction(load_coulomb_n=15.0, smoothing_m_per_s=1e-3)}, {"faults": (Backlash(gap_m=1e-4),)}],
    ids=["sharp friction", "play"],
)
def test_sharp_friction_and_play_get_enough_substeps(masses: int, options: dict) -> None:
    states = []
    for substeps in (None, 128):
        axis = BeltAxis(
            mechanics=Mechanics(masses=masses), motion=fast_stroke(dwell_s=0.02), excitation_n_m=MULTISINE,
            seconds=0.75, substeps=substeps, **options,
        )  # fmt: skip
        states.append(SimulatedAxis(axis).run()[1].states)
    chosen, fine = states
    assert np.max(np.abs(chosen - fine) / np.max(np.abs(fine), axis=1, keepdims=True)) < 1e-6


@pytest.mark.parametrize("masses", [2, 3])
def test_a_stroke_follows_the_equations_of_motion_with_friction(masses: int) -> None:
    # `python -m bench.axis` does the same over the paper's stroke, which takes three times as long.
    assert stroke_error(masses, True, "DOP853", Strokes(speed_m_per_s=1.2, dwell_s=0.02)) < 1e-8
