"""A proposed filter is the one that was asked for, and the margins it promises are those that it gives."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from livebode.analysis import OpenLoop, peak_sensitivity_at_lines, worst
from livebode.core import PID, Loop, UsageError
from livebode.fitting import EvaluationGrid, Fitter, Rigid
from livebode_control.tuning.filter_proposal import tuning
from livebode_control.tuning.filters import low_pass, notch, notch_over
from tests.support.belt_loops import BAND_HZ, LINES, responses_of
from tests.support.errors import refused
from tools.loops import BELT, MODEL, Case, parameters

RATE_HZ = 4000.0
PLACES_M = np.linspace(0.3, 1.5, 9)
# Keff over the stroke, as (13) has it within a few per cent.
BELTS = np.array([BELT * [1, 1, k, 1] for k in np.linspace(1.5, 0.75, 9)])
COVARIANCE = np.array([np.diag((0.005 * belt) ** 2) for belt in BELTS])
FITS = parameters(BELTS, COVARIANCE, PLACES_M)


@given(st.floats(1.0, 1900.0), st.floats(3.0, 40.0), st.floats(0.02, 2.0))
def test_a_notch_is_its_formula_at_its_centre_at_rest_and_at_half_the_rate(f: float, depth: float, d: float) -> None:
    at = notch(f, depth, d, RATE_HZ).response(np.array([0.0, f, RATE_HZ / 2]))
    assert abs(at) == pytest.approx([1.0, 10 ** (-depth / 20), 1.0], rel=1e-6)


@given(st.floats(5.0, 400.0), st.floats(1.001, 2.0), st.sampled_from([6.0, 20.0, 32.0]))
def test_a_notch_over_a_range_is_half_its_depth_down_everywhere_in_it(low: float, ratio: float, depth: float) -> None:
    f = np.linspace(low, low * ratio, 50)
    inside = 20 * np.log10(np.abs(notch_over(low, low * ratio, depth, 0.0, RATE_HZ).response(f)))
    assert np.all(inside < -0.5 * depth + 1e-6)
    assert inside[[0, -1]] == pytest.approx([-0.5 * depth] * 2)


def test_biquads_are_those_of_scipy() -> None:
    f = np.geomspace(1.0, 1999.0, 50)
    b, a = signal.butter(2, 100.0, fs=RATE_HZ)
    assert np.allclose(low_pass(100.0, RATE_HZ).response(f), signal.freqz(b, a, f, fs=RATE_HZ)[1], rtol=1e-9)
    found = notch(60.0, 20.0, 0.5, RATE_HZ)
    assert np.allclose(found.response(f), signal.freqz(found.b, (1.0, *found.a), f, fs=RATE_HZ)[1], rtol=1e-9)


@pytest.mark.parametrize(("gain", "enough"), [(3 * 0.2308, True), (6 * 0.2308, False)])
def test_the_promised_margins_are_those_of_python_control(gain: float, enough: bool) -> None:
    case = Case(BELT, gain=gain, delay_ticks=8)
    found = tuning(FITS, case.open, BAND_HZ)
    assert found.verdict == "suggested"
    best = found.proposals[0]
    assert best.enough == enough
    assert worst(best.after)["peak_sensitivity"] < worst(found.before)["peak_sensitivity"]
    omega = 2 * np.pi * np.geomspace(0.05, 1999.9, 6000)
    for i in (0, 4, 8):
        there = Case(BELTS[i], gain=gain, delay_ticks=8)
        value = there.response(omega / 2 / np.pi) * best.biquad.response(omega / 2 / np.pi)
        gains, turns, distances, *_ = control.stability_margins(control.frd(value, omega, smooth=True), returnall=True)
        one = dict(zip(best.after.names, best.after.value[i]))
        assert one["gain_margin"] == pytest.approx(20 * np.log10(gains[gains > 1].min()), rel=1e-4)
        assert abs(one["phase_margin"]) == pytest.approx(np.abs(turns).min(), rel=1e-4)
        assert one["peak_sensitivity"] == pytest.approx(1 / distances.min(), rel=1e-4)


def test_a_notch_for_all_positions_is_wider_than_for_one() -> None:
    loop = Case(BELT, gain=6 * 0.2308, delay_ticks=8).open
    of_all, of_one = (tuning(fits, loop, BAND_HZ).proposals[0].about for fits in (FITS, FITS[np.array([8])]))
    assert of_all["to_hz"] / of_all["from_hz"] > 1.4
    assert of_one["to_hz"] / of_one["from_hz"] < 1.05


def test_a_stable_loop_needs_no_filter_and_an_uncertain_one_gets_none() -> None:
    assert tuning(FITS, Case(BELT).open, BAND_HZ).verdict == "none needed"
    close = Case(BELT, gain=3 * 0.2308, delay_ticks=8).open
    vague = tuning(parameters(BELTS, 900 * COVARIANCE), close, BAND_HZ)
    assert vague.verdict == "refused"
    assert "take a longer run" in vague.sentence
    unstable = tuning(FITS, Case(BELT, gain=0.2308 * 20, delay_ticks=12).open, BAND_HZ)
    assert unstable.verdict == "refused"
    assert "unstable" in unstable.sentence
    # Between 20 and 95 Hz: no one notch follows that.
    far = np.array([BELT * [1, 1, k, 1] for k in (0.12, 1.0, 2.5)])
    assert "too wide" in tuning(parameters(far, COVARIANCE[:3]), close, BAND_HZ, peak_sensitivity=1.05).sentence


def test_a_model_without_a_resonance_has_nothing_to_filter() -> None:
    fits = Fitter(Rigid()).process(
        responses_of(Rigid().at([0.005, 0.0, 0.0], EvaluationGrid.of(LINES)), 0.01, 3, seed=2)
    )
    loop = OpenLoop(Rigid(), Loop(feedback=PID(gain=4.0, rate_hz=4000, delay_ticks=3)), 4000.0)
    assert "no resonance" in tuning(fits, loop, BAND_HZ).sentence


def test_impossible_specifications_are_refused() -> None:
    with refused(UsageError, "out-of-range", argument="peak_sensitivity", value=1.0):
        tuning(FITS, Case(BELT).open, BAND_HZ, peak_sensitivity=1.0)
    with refused(UsageError, "out-of-range", argument="frequency_hz", value=3000.0, rate_hz=RATE_HZ):
        low_pass(3000.0, RATE_HZ)


def test_lines_alone_bound_the_peak_from_below() -> None:
    """Never above the model's Ms, and at it where a line stands on the peak."""
    case = Case(BELT, gain=3 * 0.2308, delay_ticks=8)
    truth = MODEL.at(parameters(BELT[np.newaxis]).value[0], EvaluationGrid.of(LINES))
    size, bound, at_hz = peak_sensitivity_at_lines(responses_of(truth, 1e-3, 1, seed=3), case.loop)
    f = np.geomspace(1.0, 1999.0, 20_000)
    sensitivity = 1 / np.abs(1 + case.open.at(parameters(BELT[np.newaxis]).value, f)[0])
    assert size[0] <= sensitivity.max() + bound[0]
    assert size[0] == pytest.approx(sensitivity[np.argmin(np.abs(f - at_hz[0]))], abs=3 * bound[0] + 0.01)
