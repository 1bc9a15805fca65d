"""An axis that only its feedback and noise move shows no friction, and says so."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.core import Block, SignalError
from livebode.motion import friction_curve

RATE_HZ, GAIN_N_M_S, INERTIA_KG_M2 = 1000.0, 0.2, 0.005


def test_feedback_against_noise_is_not_taken_for_friction() -> None:
    """Least squares would give a viscous friction of minus the controller's gain."""
    torque = 0.05 * np.random.default_rng(1).standard_normal(30_000)
    speed = np.zeros(torque.size)
    for n in range(1, speed.size):
        speed[n] = speed[n - 1] + (torque[n] - GAIN_N_M_S * speed[n - 1]) / (INERTIA_KG_M2 * RATE_HZ)
    block = Block(np.stack([-GAIN_N_M_S * speed, speed]), ("u", "velocity"), RATE_HZ)
    with pytest.raises(SignalError, match="longer strokes"):
        friction_curve(block, input="u", output="velocity", kind="velocity")
