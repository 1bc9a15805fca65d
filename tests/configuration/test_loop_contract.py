"""[loop]: what the keys of a controller add to its response."""

from __future__ import annotations

from typing import Any

import numpy as np

from livebode.arrays import Complex
from livebode.configuration import LoopSection

RATE_HZ, F_HZ, TIME_S = 4000.0, np.linspace(5.0, 500.0, 20), 0.002
PI = {"gain": 0.23, "integral_time_s": 0.2, "rate_hz": RATE_HZ}
PD = {"position_gain": 30.0, "velocity_gain": 0.2, "rate_hz": RATE_HZ}
LOW_PASS = 1 / (1 + TIME_S * RATE_HZ * (1 - np.exp(-2j * np.pi * F_HZ / RATE_HZ)))
"""First order, by backward differences at the rate of the controller."""


def feedback(**loop: Any) -> Complex:
    return LoopSection.model_validate(loop).build(RATE_HZ).feedback_at(F_HZ)


def test_a_low_pass_is_on_the_output_of_the_controller_that_has_it() -> None:
    for part, keys in (("velocity", PI), ("position_pd", PD)):
        filtered = feedback(**{part: keys | {"lowpass_s": TIME_S}})
        np.testing.assert_allclose(filtered, LOW_PASS * feedback(**{part: keys}), rtol=1e-12)
    alone, position = feedback(velocity=PI), {"gain": 20.0, "rate_hz": RATE_HZ}
    cascade, filtered = (feedback(velocity=PI, position=position | {"lowpass_s": tau}) for tau in (0.0, TIME_S))
    np.testing.assert_allclose(filtered - alone, LOW_PASS * (cascade - alone), rtol=1e-9)
