"""A velocity that is late behind the torque: the moving model has the delay, and its masses are the machine's."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.core import Block
from livebode.motion import MotionCorrection
from livebode.simulation import SimulatedAxis
from tests.support.axes import RATE_HZ
from tests.support.moving import SETTINGS, axis

NAMES = ("w", "u", "velocity", "x")


def test_a_late_velocity_is_a_delay_and_no_other_mass() -> None:
    """Without a delay in the model two ticks made the inertia 3.1 % and the stiffness 3.4 % wrong."""
    ticks = 2
    run = axis(0.1, 1, 1)
    block, _ = SimulatedAxis(run).run()
    data = block.data[[block.index(name) for name in NAMES]]
    data[2, ticks:] = data[2, : data.shape[1] - ticks].copy()
    correction = MotionCorrection(SETTINGS, radius_m=run.mechanics.radius_m, chunk_samples=16000)
    correction.process(Block(data, NAMES, block.rate_hz))
    correction.finish()
    model = correction.model
    assert model is not None
    assert model.delay_s * RATE_HZ == pytest.approx(ticks, abs=0.05)
    assert model.inertia_kg_m2 == pytest.approx(0.0028, rel=0.005)
    assert float(np.asarray(model.stiffness_at(0.8))) == pytest.approx(5e5, rel=0.01)
