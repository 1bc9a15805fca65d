"""The text of a trial: the controllers that it describes, and texts that are not one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from livebode.core import PID, UsageError
from livebode_control.trial.trial_steps import trial_feedback, trial_steps
from livebode_control.tuning.filters import low_pass, notch
from livebode_control.tuning.plant_band import PlantBand

RATE_HZ = 4000.0
CONTROLLER = PID(gain=0.2, integral_time_s=0.2, rate_hz=RATE_HZ)
F = np.geomspace(1, 1900, 50)


def test_gains_times_filters_and_delay_are_those_of_the_text() -> None:
    found = trial_feedback(
        "gain~0.4~~integral_time_s~0.1~~notch~60~20~0.3~~low-pass~300~~delay~0.5", CONTROLLER, RATE_HZ
    )
    expected = (
        PID(gain=0.4, integral_time_s=0.1, rate_hz=RATE_HZ) * notch(60, 20, 0.3, RATE_HZ) * low_pass(300, RATE_HZ)
    )
    np.testing.assert_allclose(found.response(F), expected.response(F) * np.exp(-1e-3j * np.pi * F), rtol=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        "gain", "gain~", "gain~x", "gain~nan", "gain~inf", "gain~0", "gain~1e300", "gain~1~2", "other~1",
        "derivative_time_s~0.1", "notch~60~20", "notch~60~20~0", "notch~0~20~0.3", "notch~2000~20~0.3",
        "notch~60~1e9~0.3", "low-pass~0", "low-pass~nan", "low-pass~5000", "low-pass~300~~low-pass~300", "delay~-1",
        "delay~1e9", "~~".join(["notch~60~20~0.3"] * 5),
    ],
)  # fmt: skip
def test_a_text_that_is_not_a_trial_is_a_usage_error(text: str) -> None:
    with pytest.raises(UsageError):
        trial_feedback(text, CONTROLLER, RATE_HZ)


def test_a_loop_that_may_be_unstable_within_the_bounds_has_no_band_and_an_unstable_one_no_step() -> None:
    """An integrator with a delay of 1 ms, whose gain margin is that of a gain of 78."""
    lines, described = np.linspace(10, 400, 40), PID(gain=0.2, rate_hz=RATE_HZ)
    value = (20 / (2j * np.pi * lines) * np.exp(-2e-3j * np.pi * lines))[np.newaxis]
    plant = PlantBand.at_lines(lines, value, 0.6 * np.abs(value), 0.1 * np.abs(value), RATE_HZ)

    def found(gain: float, *, of_plant: bool = True) -> dict[str, Any]:
        return trial_steps(plant, described, PID(gain=gain, rate_hz=RATE_HZ), of_plant=of_plant)

    near = found(50.0)
    assert near["before"]["reference"]["low"] is not None
    assert near["before"]["noise"]["low"] < near["before"]["noise"]["value"] < near["before"]["noise"]["high"]
    assert near["after"]["reference"]["low"] is near["after"]["noise"]["low"] is None
    assert found(200.0) == {"before": None, "after": None}
    assert found(1.0, of_plant=False)["after"]["disturbance"] is None
