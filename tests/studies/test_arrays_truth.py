"""Three arrays of a servo that nothing of livebode simulated, against its exact plant and against SciPy.

100 recordings in closed loop, and 66 lines: whether the error of a value is within its 95 % bound is drawn 6600 times.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from scipy.stats import binom

import livebode
from livebode.core import Response
from studies import arrays
from studies.arrays import LINES_HZ, PERIOD, SERVO, Signals

SEEDS = 100
# The test for a drift has a false alarm in one of 200 recordings.
pytestmark = pytest.mark.filterwarnings("ignore:frf. the response drifts:livebode.SignalWarning")


@cache
def recordings() -> Signals:
    return arrays.recordings(9.0, SEEDS)


@cache
def responses() -> list[Response]:
    signals = recordings()
    return [livebode.frf(signals.w, u, y, fs=SERVO.rate_hz) for u, y in zip(signals.u, signals.y)]


def test_the_bound_of_one_response_over_all_periods_covers_as_often_as_it_says() -> None:
    truth = SERVO.response(LINES_HZ)
    hits = sum(int(np.sum(np.abs(r.value - truth) <= r.bound())) for r in responses())
    draws = SEEDS * len(LINES_HZ)
    low, high = binom.interval(0.999, draws, 0.95)
    assert low <= hits <= high, hits / draws


def test_the_lines_and_the_period_are_those_of_the_excitation() -> None:
    for response in responses():
        assert response.frequency_hz.tolist() == LINES_HZ.tolist()
        assert response.lines.window == PERIOD
        assert response.estimator == "joint"
        assert response.time_s == pytest.approx(3.5, abs=1e-3)  # all seven periods: none is a transient


def test_where_spectra_by_scipy_are_biased_by_feedback_the_mean_over_recordings_is_not() -> None:
    """At 43 Hz the plant is 29 dB below its mean, and H1 turns towards -1/F, the inverse of the controller."""
    signals, truth = recordings(), SERVO.response(LINES_HZ)
    line = int(np.argmin(np.abs(truth)))

    def mean_error(values: list[complex]) -> tuple[float, float]:
        error = (np.array(values) - truth[line]) / abs(truth[line])
        return abs(error.mean()), error.std() / np.sqrt(SEEDS)

    own, own_sigma = mean_error([r.value[line] for r in responses()])
    by_scipy = [arrays.by_scipy(u, y) for u, y in zip(signals.u, signals.y)]
    other, other_sigma = mean_error([np.interp(LINES_HZ[line], f, value) for f, value, _ in by_scipy])
    assert own < 3 * own_sigma
    assert other > 3 * other_sigma


@pytest.mark.parametrize(
    ("method", "times"),
    [(arrays.by_scipy, 20.0), (arrays.by_scipy_with_period, 1.0), (arrays.by_scipy_with_w, 0.95)],
)
def test_the_error_at_the_resonance_is_no_larger_than_that_of_scipy(
    method: Callable[..., object], times: float
) -> None:
    truth = SERVO.response(LINES_HZ)[arrays.RESONANCE]
    own = np.sqrt(np.mean([abs(r.value[arrays.RESONANCE] / truth - 1) ** 2 for r in responses()]))
    assert arrays.score(method, recordings()).error_at_resonance > times * own


def test_python_control_draws_and_closes_a_loop_around_a_measured_response() -> None:
    import control

    response = responses()[0]
    closed = control.feedback(response.to_frd() * 0.4)
    truth = 0.4 * SERVO.response(LINES_HZ) / (1 + 0.4 * SERVO.response(LINES_HZ))
    assert np.abs(closed.frdata[0, 0] / truth - 1).max() < 1.0
    assert np.median(np.abs(closed.frdata[0, 0] / truth - 1)) < 0.1


def test_the_lines_of_code_of_a_method_are_counted_as_a_person_would() -> None:
    assert arrays.lines_of_code(arrays.by_livebode) == 1
    assert arrays.lines_of_code(arrays.by_scipy) == 2
    assert arrays.lines_of_code(arrays.by_scipy_with_coherence) == 6
