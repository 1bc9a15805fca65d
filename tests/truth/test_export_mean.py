"""The mean of overlapping windows has the sigma of its formula, and that covers the truth.

Statistical bounds: 400 runs of 7 lines give a coverage of 63 % to ± 1 % and one of 98 % to ± 0.3 % (one standard
deviation). Next to the resonance (60 Hz) the responses' own sigma is too high, and so is that of the mean.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from examples.closed_loop import RATE_HZ, Drive, Plant
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine
from livebode.export import mean
from livebode.nouns import Block, InputError, Lines, Response, Responses
from tests.responses import any_responses, cut, made

LINES = Lines.parse("20:140:20", rate_hz=RATE_HZ, window=400)
RUNS, PERIODS, SIGMA = 400, 20, 0.1
TRUTH = Plant().response(LINES.frequency_hz)


@cache
def runs(hop: int, louder: float = 1.0) -> list[Responses]:
    """Runs in closed loop; in the second half the noise may be louder."""
    w, settled = multisine(LINES), 4 * LINES.window
    settings = Settings(lines=LINES, output="y", input="u", excitation="w", hop=hop)
    total = (4 + PERIODS) * LINES.window
    noise = np.full(total, SIGMA)
    noise[settled + PERIODS * LINES.window // 2 :] *= louder
    u, y = _run(w, noise)
    blocks = (Block(np.array([np.tile(w, PERIODS), u[i, settled:], y[i, settled:]]), ("w", "u", "y"), RATE_HZ)
              for i in range(RUNS))  # fmt: skip
    return [Tracker(settings).process(block) for block in blocks]


def _run(w: np.ndarray, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    rng, drive = np.random.default_rng(31), Drive()
    state = np.tile(drive.settled(w), (RUNS, 1))
    u, y = np.empty((2, RUNS, noise.size))
    for n, amplitude in enumerate(noise):
        state, u[:, n], y[:, n] = drive.tick(state, w[n % w.size], amplitude * rng.standard_normal(RUNS), n)
    return u, y


def error(means: list[Response]) -> np.ndarray:
    return np.abs(np.array([m.value for m in means]) - TRUTH)


def coverage(hop: int, louder: float) -> tuple[float, float]:
    """Shares of errors within the bounds for 63 % and 98 %."""
    means = [mean([responses]) for responses in runs(hop, louder)]
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
    sigma = {hop: np.mean([mean([r]).sigma for r in runs(hop)], axis=0) for hop in (400, 100, 20)}
    np.testing.assert_allclose(sigma[100], sigma[400], rtol=0.1)
    np.testing.assert_allclose(sigma[20], sigma[400], rtol=0.1)


@pytest.mark.parametrize("louder", [2.0, 5.0])
def test_bounds_nearly_hold_where_noise_grows(louder: float) -> None:
    assert coverage(100, louder)[1] > 0.93


@settings(max_examples=60, deadline=None)
@given(any_responses(), st.lists(st.integers(0, 6), max_size=3))
def test_sigma_is_that_of_the_formula_for_every_cut(responses: Responses, at: list[int]) -> None:
    used = responses.valid & np.isfinite(responses.sigma)
    if not used.any():
        with pytest.raises(InputError, match="no response has a valid line"):
            mean(cut(responses, *at))
        return
    found = mean(cut(responses, *at))
    apart = np.abs(responses.first[:, np.newaxis] - responses.first)
    shared = np.maximum(0, 1 - apart / responses.lines.window)
    for line in range(len(responses.lines)):
        rows = used[:, line]
        assert found.valid[line] == rows.any()
        if not rows.any():
            assert np.isnan(found.value[line])
            continue
        value, sigma = responses.value[rows, line], responses.sigma[rows, line]
        assert found.value[line] == pytest.approx(value.mean(), rel=1e-9, abs=1e-9 * np.abs(value).max())
        variance = sigma @ shared[np.ix_(rows, rows)] @ sigma / len(sigma) ** 2
        assert found.sigma[line] == pytest.approx(np.sqrt(variance), rel=1e-9)


def test_averages_are_not_averaged_again() -> None:
    responses = made(40, LINES)
    responses.first[:] = 0
    with pytest.raises(InputError, match=r"averages over periods already.*--at TIME"):
        mean([responses])
