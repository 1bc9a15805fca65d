"""Spectra of samples at uneven times: the least-squares solution, the DFT on even samples, and covered errors."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode import Block, Lines, Responses, Settings, SignalError, Tracker, multisine
from livebode.estimation import UnevenSpectra, UnevenTracker
from livebode.preparation import UnevenSource
from livebode.sources import open_file, uneven_log_of
from tests.support.errors import refused
from tests.support.uneven import write_mdf

RATE_HZ, WINDOW = 1000.0, 200
LINES = Lines.parse("10:80:10", RATE_HZ, WINDOW)


def log_of(folder, channels):
    """A log of these channels, at their times, on a grid of 1 kHz from the first time of w on."""
    return uneven_log_of(open_file(write_mdf(folder / "log.mf4", channels)), list(channels), rate_hz=RATE_HZ)


def responses_of(log, schedule=None, drifting=(), lines=LINES, **options):
    wanted = Settings(lines=lines, output="y", input="u", excitation="w", schedule=schedule, **options)
    source = UnevenSource(log, wanted, [schedule] if schedule else [], drifting)
    tracker = UnevenTracker(wanted, source.layout)
    return Responses.join([tracker.process(block) for block in source.blocks()])


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    places=st.sampled_from([1, 4, 20]),
    samples=st.integers(60, 300),
    trend=st.booleans(),
    missing=st.integers(0, 10),
)
def test_a_window_is_the_least_squares_solution_for_any_times(seed, places, samples, trend, missing):
    """Against numpy.linalg.lstsq, with its covariance."""
    rng = np.random.default_rng(seed)
    k, quiet = np.array([1, 3, 4, 9, 17]), np.array([2, 5, 6])
    time = np.sort(rng.uniform(-0.5, WINDOW - 0.5, samples)) / WINDOW
    x = rng.standard_normal((2, samples))
    x[1, rng.integers(0, samples, missing)] = np.nan
    fit = UnevenSpectra(tuple(k), tuple(quiet), WINDOW, places, samples, [trend, trend])
    cuts = np.searchsorted(time, (np.arange(places + 1) * WINDOW / places - 0.5) / WINDOW)
    window = fit.window(np.array([fit.segment(time[a:b], x[:, a:b]) for a, b in pairwise(cuts)]))
    for row, values in enumerate(x):
        known = np.isfinite(values)
        t = time[known]
        angle = 2 * np.pi * np.outer(t, k)
        columns = [np.ones((t.size, 1)), *([t[:, None]] if trend else []), np.cos(angle), np.sin(angle)]
        matrix = np.concatenate(columns, axis=1)
        solution = np.linalg.lstsq(matrix, values[known])[0]
        a, b = solution[1 + trend :].reshape(2, k.size)
        np.testing.assert_allclose(window.sums[row, : k.size] / WINDOW, (a - 1j * b) / 2, rtol=0, atol=1e-9)
        spread = np.diag(np.linalg.inv(matrix.T @ matrix))[1 + trend :].reshape(2, -1).sum(axis=0)
        np.testing.assert_allclose(window.inflation[row], spread / 4 * samples, rtol=1e-7)
        # At the detection lines: the residual, scaled so that white noise has the same power as at the lines.
        tones = np.exp(-2j * np.pi * np.outer(quiet, t))
        off = tones - (tones @ matrix) @ np.linalg.pinv(matrix)
        scale = np.sqrt(spread.mean() / 4) / np.linalg.norm(off, axis=1)
        rest = tones @ (values[known] - matrix @ solution)
        np.testing.assert_allclose(window.sums[row, k.size :], WINDOW * scale * rest, rtol=0, atol=1e-8)


@pytest.mark.parametrize("options", [{}, {"average": True}, {"schedule": "n", "noise": "quiet"}], ids=str)
def test_on_even_samples_the_responses_are_those_of_a_tracker(tmp_path, options):
    """To 1e-9, with noise: values, bounds, coherence, validity and times, window by window."""
    rng = np.random.default_rng(2)
    w = np.tile(multisine(LINES), 12)
    data = np.array([w, w + 0.1 * rng.standard_normal(w.size), 2 * w + 0.1 * rng.standard_normal(w.size)])
    position = np.sin(np.arange(w.size) / 700)
    log = log_of(tmp_path, {name: (np.arange(w.size) / RATE_HZ, row) for name, row in zip("wuyn", [*data, position])})
    found = responses_of(log, **options)
    tracker = Tracker(Settings(lines=LINES, output="y", input="u", excitation="w", **options), repeating=False)
    expected = tracker.process(Block(np.array([*data, position]), ("w", "u", "y", "n"), RATE_HZ))
    expected = expected[np.searchsorted(expected.sample, found.sample[0]) :]
    np.testing.assert_array_equal(found.sample, expected.sample)
    np.testing.assert_array_equal(found.valid, expected.valid)
    for name in ("value", "sigma", "dof", "coherence", "time_s"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-9, err_msg=name)
    if "schedule" in options:
        np.testing.assert_allclose(found.schedule, expected.schedule, atol=1e-6)


def test_a_drift_is_fitted_with_a_trend(tmp_path):
    """A ramp of 1,000 times the excitation leaves the response as it is; without the trend it does not."""
    rng = np.random.default_rng(3)
    t = np.sort(rng.uniform(0, 3, 3000))
    w, y = (sum(np.cos(2 * np.pi * f * t + f + shift) for f in LINES.frequency_hz) for shift in (0.0, 0.3))
    log = log_of(tmp_path, {"w": (t, w), "u": (t, w), "y": (t, y + 1000 * t)})
    for drifting, good in ((("y",), True), ((), False)):
        value = responses_of(log, drifting=drifting).value[-1]
        assert np.allclose(value, np.exp(0.3j), rtol=0, atol=1e-8) == good


def test_stamps_that_are_wrong_make_a_line_smaller_by_the_mean_phasor_of_their_errors():
    """The bias that the docstring states, at 80 Hz with a standard deviation of 1 ms."""
    rng = np.random.default_rng(4)
    sampled = np.sort(rng.uniform(0, 1, 20_000))
    stamped = sampled + 1e-3 * rng.standard_normal(sampled.size)
    fit = UnevenSpectra((80,), (), WINDOW, 1, sampled.size, [False])
    line = fit.window(fit.segment(stamped % 1.0, np.cos(2 * np.pi * 80 * sampled)[np.newaxis])[np.newaxis]).sums
    assert abs(line[0, 0]) * 2 / WINDOW == pytest.approx(np.exp(-((2 * np.pi * 80 * 1e-3) ** 2) / 2), abs=0.02)


def test_lines_that_alias_onto_each_other_are_refused(tmp_path):
    """At 100 regular samples per second, 40 Hz and 60 Hz are the same samples."""
    t, slow = np.arange(4000) / RATE_HZ, np.arange(400) / 100
    log = log_of(tmp_path, {"w": (t, np.cos(t)), "u": (t, np.sin(t)), "y": (slow, np.cos(slow))})
    with refused(SignalError, "lines-inseparable", channel="y", frequencies_hz=[40.0, 60.0]):
        responses_of(log, lines=Lines.parse("40,60", RATE_HZ, WINDOW))


def test_a_window_with_a_gap_in_one_channel_is_not_valid(tmp_path):
    rng = np.random.default_rng(5)
    t = np.sort(rng.uniform(0, 3, 3000))
    w = sum(np.cos(2 * np.pi * f * t + f) for f in LINES.frequency_hz)
    there = (t < 1.4) | (t > 1.58)
    log = log_of(tmp_path, {"w": (t, w), "u": (t, w), "y": (t[there], w[there])})
    found = responses_of(log)
    overlap = np.clip(np.minimum(found.sample + 1, 1580) - np.maximum(found.sample + 1 - WINDOW, 1400), 0, None)
    assert not found.valid[overlap >= 160].any()
    assert found.valid[overlap <= 10].all()
