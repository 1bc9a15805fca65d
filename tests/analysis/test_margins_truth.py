"""Margins are those of python-control on the same sampled loop, and their bounds hold."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from scipy.stats import norm

from livebode.analysis import Margins, OpenLoop, against_lines, margins, margins_of
from livebode.arrays import Floats
from livebode.core import PID, FitError, LivebodeError, Loop, Responses, UsageError
from livebode.fitting import EvaluationGrid, Fitter, Rigid, fit
from tests.support.belt_loops import BAND_HZ, LINES, read, responses_of
from tests.support.errors import refused
from tools.loops import BELT, MODEL, Case, parameters, values


@st.composite
def cases(draw: st.DrawFn) -> Case:
    """Resonances from 20 to 400 Hz, hardly damped to well damped, from an idle loop to one that is unstable."""
    js, load = draw(st.floats(5e-4, 2e-2)), draw(st.floats(1.0, 40.0))
    shaft = load * 0.019**2
    omega = 2 * np.pi * draw(st.floats(20.0, 400.0))
    reduced = js * shaft / (js + shaft)
    stiffness = reduced * omega**2
    damping = 2 * draw(st.floats(0.01, 0.3)) * reduced * omega
    crossover = 2 * np.pi * draw(st.floats(3.0, 300.0))
    return Case(
        belt=np.array([js, load, stiffness / 0.019**2, damping / 0.019**2]),
        gain=(js + shaft) * crossover,
        integral_time_s=draw(st.sampled_from([1.0, 0.2, 0.02])),
        position_gain=draw(st.sampled_from([1.0, 10.0])),
        delay_ticks=draw(st.integers(0, 4)),
    )


@settings(max_examples=5, deadline=None)
@given(cases())
def test_margins_are_those_of_python_control(case: Case) -> None:
    assume(abs(case.largest_pole - 1) > 1e-5)
    found = read(case)
    assert found.ok[0] == (case.largest_pole < 1)
    if not found.ok[0]:
        return
    # Its polynomial method finds crossings that are none, from the poles near z = 1; on a fine response it is right.
    omega = 2 * np.pi * np.geomspace(0.05, 1999.9, 12_000)
    measured = control.frd(case.response(omega / 2 / np.pi), omega, smooth=True)
    gains, turns, distances, _, at_gain, _ = control.stability_margins(measured, returnall=True)
    end = case.response(np.array([2000.0])).real
    gains = np.append(gains, -1 / end[end < 0])
    up, down = gains[gains > 1], gains[gains < 1]
    late = np.radians(turns % 360) / at_gain
    one = dict(zip(found.names, found.value[0]))
    assert one["gain_margin"] == pytest.approx(20 * np.log10(up.min()) if up.size else np.inf, rel=1e-4)
    assert one["gain_reduction"] == pytest.approx(-20 * np.log10(down.max()) if down.size else np.inf, rel=1e-4)
    assert abs(one["phase_margin"]) == pytest.approx(np.abs(turns).min(), rel=1e-4)
    assert one["delay_margin"] == pytest.approx(1e3 * late.min(), rel=1e-4)
    inside = 1 / np.append(distances, np.abs(1 + end))
    assert one["peak_sensitivity"] == pytest.approx(inside.max(), rel=1e-4)


@settings(max_examples=15, deadline=None)
@given(cases())
def test_peak_and_bandwidth_are_those_of_a_fine_comb(case: Case) -> None:
    found = read(case)
    assume(found.ok[0])
    f = np.geomspace(1e-2, 2000, 100_000)
    value = case.open.at(parameters(case.belt[np.newaxis]).value, f)[0]
    seen = np.max(1 / np.abs(1 + value))
    assert seen * (1 - 1e-9) <= found.of("peak_sensitivity")[0] <= seen * (1 + 1e-3)
    below = np.flatnonzero(np.abs(value / (1 + value)) < 10 ** (-3 / 20))
    true = f[below[0]] if below.size else np.nan
    assert found.of("bandwidth")[0] == pytest.approx(true, rel=3e-4, nan_ok=True)


@pytest.mark.parametrize("case", [Case(BELT, gain=4 * 0.2308, delay_ticks=4), Case(BELT, delay_ticks=8)])
def test_bounds_hold_what_they_promise(case: Case) -> None:
    """1,000 fits to noisy lines: 95 % of the true margins within the 95 % bound, ± 2 points."""
    truth = MODEL.at(parameters(BELT[np.newaxis]).value[0], EvaluationGrid.of(LINES))
    noisy = responses_of(truth, 0.03 * float(np.median(np.abs(truth))), 1000, seed=1)
    found = margins(Fitter(MODEL).process(noisy), case.open, BAND_HZ)
    assert found.ok.all()
    true = read(case)
    inside = np.mean(np.abs(found.value - true.value) <= found.bound(), axis=0)
    assert np.all((inside > 0.93) & (inside < 0.97)), dict(zip(found.names, inside))
    place = np.abs(found.frequency_hz - true.frequency_hz) <= 1.96 * found.frequency_sigma_hz
    assert np.all((place.mean(axis=0) > 0.93) & (place.mean(axis=0) < 0.97)), place.mean(axis=0)


def test_a_margin_without_a_crossing_is_infinite_and_marked() -> None:
    """A rigid axis under a P controller: no phase crossing but the sampled one at half the rate; L never below −1."""
    loop = OpenLoop(Rigid(), Loop(feedback=PID(gain=0.2, rate_hz=4000)), 4000.0)
    fits = Fitter(Rigid()).process(
        responses_of(Rigid().at([0.005, 0.0, 0.0], EvaluationGrid.of(LINES)), 0.01, 5, seed=2)
    )
    found = margins(fits, loop, BAND_HZ)
    assert np.all(np.isinf(found.of("gain_reduction")))
    assert np.all(found.place[:, found.index("gain_reduction")] == "none")
    # L = K·T/(J·(z − 1)), which is −K·T/(2·J) at z = −1.
    assert found.of("gain_margin") == pytest.approx(20 * np.log10(2 * 4000 * fits["J"] / 0.2), rel=1e-6)
    assert np.all(found.place[:, found.index("gain_margin")] == "extrapolated")


def test_places_are_marked_by_the_band() -> None:
    fits = parameters(BELT[np.newaxis])
    loop = Case(BELT, gain=4 * 0.2308, delay_ticks=4).open
    wide, narrow = margins(fits, loop, (0.1, 1999.0)), margins(fits, loop, (30.0, 60.0))
    assert np.all(wide.place == "interpolated")
    assert np.all(narrow.place == "extrapolated")


def test_rows_without_a_fit_and_unstable_ones_hold_no_numbers() -> None:
    fits = replace(parameters(np.tile(BELT, (3, 1))), status=np.array(["ok", "at a bound", "ok"]))
    found = margins(fits, Case(BELT, gain=0.2308 * 20, delay_ticks=12).open, BAND_HZ)
    assert found.status.tolist() == ["unstable by the fit", "at a bound", "unstable by the fit"]
    assert np.isnan(found.value).all()


def test_impossible_loops_and_bands_are_refused() -> None:
    with refused(FitError, "loop-unknown"):
        OpenLoop(MODEL, Loop(), 4000.0)
    with refused(UsageError, "out-of-range", argument="band_hz", value=[140.0, 20.0]):
        margins(parameters(BELT[np.newaxis]), Case(BELT).open, (140.0, 20.0))
    with refused(UsageError, "unknown-name", value="phase"):
        read(Case(BELT)).of("phase")
    with pytest.raises(LivebodeError, match="probability=1"):
        read(Case(BELT)).bound(1)


def delayed(gain: float, ticks: float) -> tuple[Case, Margins, Responses]:
    """A loop, its true margins with a delay in the plant, and 100 noisy responses of that plant."""
    case, at = Case(BELT, gain=gain), values(BELT[np.newaxis])
    at[:, -1] = ticks / case.rate_hz
    truth = MODEL.at(at[0], EvaluationGrid.of(LINES))
    true = margins(replace(parameters(BELT[np.newaxis]), value=at), case.open, BAND_HZ)
    return case, true, responses_of(truth, 0.01 * float(np.median(np.abs(truth))), 100, seed=4)


def test_a_delay_that_nobody_freed_is_found_and_the_margins_cover_the_true_ones() -> None:
    case, true, measured = delayed(0.6, 1.5)
    found = margins(Fitter(MODEL).process(measured), case.open, BAND_HZ)
    assert found.ok.all()
    apart = np.abs(found.value - true.value) <= found.bound()
    print(f"true {true.value[0].round(3)}, coverage {apart.mean(axis=0)}")
    # 100 fits scatter by 2.2 points of the coverage.
    assert apart.mean(axis=0).min() >= 0.95 - 3 * 0.022
    assert against_lines(found, measured, case.loop).ok.all()


@pytest.mark.parametrize("ticks", [1.5, 3.0])
def test_a_fit_that_the_lines_contradict_has_no_margins(ticks: float) -> None:
    case, true, measured = delayed(0.6, ticks)
    held = margins(Fitter(MODEL, fixed={"delay": 0.0}).process(measured), case.open, BAND_HZ)
    assert np.all(held.of("gain_margin") > true.of("gain_margin") + 5)
    found = against_lines(held, measured, case.loop)
    assert set(found.status) == {"contradicted by the lines"}
    assert np.isnan(found.value).all()
    assert np.isnan(found.bound()).all()
    assert set(found.place.ravel()) == {"none"}


def test_lines_do_not_contradict_true_margins() -> None:
    for gain in (0.1, 0.2308, 0.6):
        case, _, measured = delayed(gain, 0.0)
        found = against_lines(margins(Fitter(MODEL).process(measured), case.open, BAND_HZ), measured, case.loop)
        assert found.ok.all()


def test_bounds_of_margins_contain_the_models_that_the_lines_do_not_tell_apart() -> None:
    """Of a fit with competitors the bound contains 95 % of the mixture of their normal distributions, by the weights,
    and the variance is at least that of the mixture."""
    f = LINES.frequency_hz
    value = MODEL.at([0.0028, 6.7, 5e5, 130.0, 0, 0, 3e-4], EvaluationGrid.of(LINES))
    rng, one = np.random.default_rng(4), np.zeros(1, dtype=int)
    sigma, ones = 0.005 * np.abs(value)[np.newaxis], np.ones((1, f.size))
    noise = sigma * (rng.standard_normal(f.size) + 1j * rng.standard_normal(f.size)) / np.sqrt(2)
    found = fit(
        Responses(LINES, value + noise, sigma, one + np.inf, ones, ones > 0, one, one, one + 0.0, one + 0.0), MODEL
    )
    loop = Loop(feedback=PID(gain=0.2308, integral_time_s=0.2, rate_hz=4000, delay_ticks=2))
    assert found.competitors is not None
    model, rows, weight = found.competitors
    each = margins(rows, OpenLoop(model, loop, 4000.0), found.band_hz)
    of = margins_of(found, loop)
    for name in ("gain_margin", "phase_margin", "bandwidth"):
        i = of.index(name)
        own, apart = each.sigma[:, i], each.value[:, i] - of.value[0, i]
        assert each.ok.all()
        root = np.sqrt(np.average(own**2 + apart**2, weights=weight))
        half = brentq(_share_missing, 0.0, 20 * root, (apart, own, weight), xtol=1e-12)
        assert of.sigma[0, i] == pytest.approx(max(root, half / norm.ppf(0.975)), rel=1e-9)
        assert of.bound()[0, i] >= 1.9 * own[0] * np.sqrt(weight[0])


def _share_missing(half: float, apart: Floats, own: Floats, weight: Floats) -> float:
    """From 95 %, of a mixture of normal distributions between -half and half."""
    within = norm.cdf((half - apart) / own) - norm.cdf((-half - apart) / own)
    return 0.95 - float(np.average(within, weights=weight))
