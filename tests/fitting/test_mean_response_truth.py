"""The mean of overlapping windows has the sigma of its formula, and that covers the truth, however the noise changes.

Statistical bounds: 200 runs of 7 lines give a coverage of 63 % to ± 1.3 % and one of 98 % to ± 0.4 % (one standard
deviation). Next to the resonance (60 Hz) the responses' own sigma is too high, and so is that of the mean.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Block, Lines, Response, Responses, SignalError
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine
from livebode.fitting import RunningMean, mean_response
from livebode.simulation import TwoMassLoop, TwoMassPlant
from livebode.simulation.two_mass_loop import RATE_HZ
from tests.support.errors import refused
from tests.support.responses import any_responses, cut, made

LINES = Lines.parse("20:140:20", rate_hz=RATE_HZ, window=400)
RUNS, PERIODS, SIGMA = 200, 20, 0.1
TRUTH = TwoMassPlant().response(LINES.frequency_hz)


@cache
def runs(hop: int, louder: float) -> list[Responses]:
    """Runs in closed loop; in the second half the noise may be louder."""
    w, settled = multisine(LINES), 4 * LINES.window
    settings = Settings(lines=LINES, output="y", input="u", excitation="w", hop=hop)
    total = (4 + PERIODS) * LINES.window
    noise = np.full(total, SIGMA)
    noise[settled + PERIODS * LINES.window // 2 :] *= louder
    u, y = TwoMassLoop().under(w, noise[:, np.newaxis] * np.random.default_rng(31).standard_normal((total, RUNS)))
    blocks = (Block(np.array([np.tile(w, PERIODS), u[i, settled:], y[i, settled:]]), ("w", "u", "y"), RATE_HZ)
              for i in range(RUNS))  # fmt: skip
    return [Tracker(settings).process(block) for block in blocks]


@cache
def means_of(hop: int, louder: float) -> list[Response]:
    """The mean of each run."""
    return [mean_response(responses)[0] for responses in runs(hop, louder)]


def error(means: list[Response]) -> np.ndarray:
    return np.abs(np.array([m.value for m in means]) - TRUTH)


def coverage(hop: int, louder: float) -> tuple[float, float]:
    """Shares of errors within the bounds for 63 % and 98 %."""
    means = means_of(hop, louder)
    within = [float(np.mean(error(means) <= np.array([m.bound(c) for m in means]))) for c in (1, 2)]
    rms = float(np.sqrt((error(means) ** 2).mean()))
    print(f"hop {hop}, noise x {louder:g}: {within[0]:.3f}, {within[1]:.3f}, rms error {rms:.5f}")
    return within[0], within[1]


@pytest.mark.parametrize("hop", [400, 100, 20])
def test_bounds_hold_what_they_promise_under_the_same_noise(hop: int) -> None:
    one, two = coverage(hop, 1.0)
    assert one == pytest.approx(0.632, abs=0.06)
    assert two == pytest.approx(0.982, abs=0.015)


def test_overlap_makes_sigma_no_smaller() -> None:
    sigma = {hop: np.mean([mean.sigma for mean in means_of(hop, 1.0)], axis=0) for hop in (400, 100, 20)}
    np.testing.assert_allclose(sigma[100], sigma[400], rtol=0.1)
    np.testing.assert_allclose(sigma[20], sigma[400], rtol=0.1)


@pytest.mark.parametrize("hop", [400, 100, 20])
def test_sigma_scatters_as_its_degrees_of_freedom_state(hop: int) -> None:
    """sigma² of d degrees of freedom has the relative variance 1/d; 200 runs of six lines give that to ± 5 %."""
    means, away = [], LINES.frequency_hz != 60
    for responses in runs(hop, 1.0):
        mean = RunningMean()
        mean.add(responses)
        means.append(mean.without_distortion()[0])
    variance = np.array([mean.sigma[away] ** 2 for mean in means])
    scatter = np.mean(variance.var(axis=0, ddof=1) / variance.mean(axis=0) ** 2)
    print(f"hop {hop}: {means[0].dof:.1f} degrees of freedom, by the scatter {1 / scatter:.1f}")
    assert means[0].dof == pytest.approx({400: 19, 100: 26.9, 20: 27.4}[hop], abs=0.1)
    assert 0.85 < means[0].dof * scatter < 1.15


@pytest.mark.parametrize("louder", [2.0, 5.0, 0.2])
def test_bounds_hold_where_noise_grows_or_fades(louder: float) -> None:
    one, two = coverage(100, louder)
    assert one == pytest.approx(0.632, abs=0.06)
    assert two == pytest.approx(0.982, abs=0.015)


@pytest.mark.parametrize("periods", [3, 5])
def test_bounds_hold_after_a_few_periods(periods: int) -> None:
    """Away from the resonance sigma is right; the few degrees of freedom are counted carefully, so bounds are wide."""
    means = [mean_response(responses[: 4 * periods])[0] for responses in runs(100, 1.0)]
    rms = np.sqrt((error(means) ** 2).mean(axis=0))
    sigma = np.sqrt(np.mean([m.sigma**2 for m in means], axis=0))
    away = LINES.frequency_hz != 60
    np.testing.assert_allclose(sigma[away], rms[away], rtol=0.12)
    assert np.mean(error(means) <= np.array([m.bound(2) for m in means])) > 0.98


@settings(max_examples=60, deadline=None)
@given(any_responses(), st.lists(st.integers(0, 6), max_size=3))
def test_sigma_is_that_of_the_formula_for_every_cut(responses: Responses, at: list[int]) -> None:
    if not responses.valid.any():
        with refused(SignalError, "no-valid-response"):
            mean_response(cut(responses, *at))
        return
    found = mean_response(cut(responses, *at))[0]
    apart = np.abs(responses.first[:, np.newaxis] - responses.first)
    shared = np.maximum(0, 1 - apart / responses.lines.window)
    free = []
    for line in range(len(responses.lines)):
        rows = responses.valid[:, line]
        assert found.valid[line] == rows.any()
        if not rows.any():
            assert np.isnan(found.value[line])
            continue
        value, sigma = responses.value[rows, line], responses.sigma[rows, line]
        assert found.value[line] == pytest.approx(value.mean(), rel=1e-9, abs=1e-9 * np.abs(value).max())
        common = shared[np.ix_(rows, rows)]
        windows = len(value) ** 2 / common.sum()
        if windows >= 2:
            expected = np.sqrt(np.var(value) / (windows - 1))
            free.append((windows - 1) * common.sum() / (common**2).sum())
        else:
            expected = np.min(sigma[np.isfinite(sigma)], initial=np.inf)
            expected = expected if np.isfinite(expected) else np.nan
        assert found.sigma[line] == pytest.approx(expected, rel=1e-9, nan_ok=True)
    if free:
        assert found.dof == pytest.approx(min(free), rel=1e-9)


def test_the_mean_of_averaged_responses_is_the_newest_valid_one() -> None:
    responses = made(40, LINES)
    responses.first[:] = 0
    responses.valid[-1] = False
    newest = responses[int(np.flatnonzero(responses.valid.any(axis=1))[-1])]
    found = mean_response([responses[:30], responses[30:]])[0]
    assert found.sample == newest.sample
    np.testing.assert_array_equal(found.value, newest.value)
    np.testing.assert_array_equal(found.sigma, newest.sigma)
