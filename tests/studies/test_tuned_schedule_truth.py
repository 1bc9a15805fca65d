"""Gains over the position keep their promise on the true belt, at the places and between them."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.core import Responses, UsageError
from livebode.simulation import BeltAxis, Drive, Mechanics
from livebode_control.tuning import LoopSpecification
from livebode_control.tuning.gain_schedule import gain_schedule
from studies.tune import DENSE, loop_margins
from studies.tune_steps import LINES, RATE_HZ

PLACES_M = np.linspace(0.3, 1.7, 6)
AXIS = BeltAxis(
    mechanics=Mechanics(load_kg=6.0, damping_n_s_per_m=300.0), drive=Drive(position_rate_hz=RATE_HZ, delay_ticks=3)
)
LIMITS = LoopSpecification()


def responses(places: np.ndarray) -> Responses:
    """Noisy responses of the belt at these places; 95 % bounds of ±5 %."""
    truth = np.array([AXIS.linear(x).sampled(RATE_HZ).response(LINES.frequency_hz) for x in places])
    noise = np.random.default_rng(0).standard_normal((2, *truth.shape)) / np.sqrt(2)
    sigma, ones, row = 0.05 / 1.73 * np.abs(truth), np.ones(truth.shape), np.zeros(len(places), dtype=np.int64)
    value = truth + sigma * (noise[0] + 1j * noise[1])
    return Responses(LINES, value, sigma, row + np.inf, ones, ones > 0, row, row, row + 0.0, places)


def test_the_limits_are_kept_at_and_between_the_places_and_the_bandwidth_rises() -> None:
    found = gain_schedule(responses(PLACES_M), AXIS.drive.loop(), LIMITS, loop_checked=True)
    assert found.share > 0
    for x in np.linspace(PLACES_M[0], PLACES_M[-1], 21):
        plant = AXIS.linear(x).sampled(RATE_HZ).response(DENSE)
        true = loop_margins(plant * found.at(x).model.response(DENSE))
        assert true is not None
        assert true.max_sensitivity <= LIMITS.max_sensitivity
        assert true.gain_margin_db >= LIMITS.gain_margin_db
        assert true.phase_margin_deg >= LIMITS.phase_margin_deg
    assert found.common.feedback.biquads
    first = found.csv().splitlines()[1].split(",")
    assert float(first[1]) == pytest.approx(found.at(PLACES_M[0]).controller.velocity.gain)  # type: ignore[union-attr]
    gained = [one.bandwidth_hz / other.bandwidth_hz for one, other in zip(found.promised, found.common_promised)]
    assert min(gained) > 0.999
    assert max(gained) > 1.005
    assert found.reach.highest_line_hz == LINES.frequency_hz[-1]
    least = min(one.bandwidth_hz for one in found.common_promised)
    assert found.common.promised.bandwidth_hz == pytest.approx(least)


def test_one_place_has_no_schedule() -> None:
    with pytest.raises(UsageError, match="two places"):
        gain_schedule(responses(PLACES_M[:1]), AXIS.drive.loop(), LIMITS, loop_checked=True)
