"""Every kind of excitation is what its definition says, and periodic on the tracker's grid."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Lines
from livebode.excitation import (
    chirp,
    chirp_lines,
    crest_between_samples,
    low_crest_phases,
    multisine,
    odd_lines,
    prbs,
    quantised,
    schroeder_phases,
    stepped_lines,
    stepped_sine,
)


@pytest.mark.parametrize("order", range(2, 21))
def test_the_autocorrelation_of_a_prbs_is_exactly_n_and_minus_one(order):
    bits = prbs(order)
    count = 2**order - 1
    assert bits.shape == (count,)
    assert set(bits) == {-1.0, 1.0}
    # Sums of up to 2^20 ones: the FFT's rounding is far below the half that would round wrongly.
    correlation = np.fft.irfft(np.abs(np.fft.rfft(bits)) ** 2, count)
    assert np.max(np.abs(correlation - np.rint(correlation))) < 1e-3
    whole = np.rint(correlation).astype(int)
    assert whole[0] == count
    assert np.all(whole[1:] == -1)


@pytest.mark.parametrize("held", [1, 3, 8])
def test_a_held_prbs_has_the_spectrum_of_its_hold(held):
    order, amplitude = 6, 0.7
    period = prbs(order, amplitude, rate_divider=held)
    bits, window = 2**order - 1, (2**order - 1) * held
    k = np.arange(1, (window + 1) // 2)
    k = k[k % bits != 0]
    hold = np.sin(np.pi * k * held / window) / (held * np.sin(np.pi * k / window))
    expected = 2 * amplitude * np.sqrt(bits + 1) / bits * np.abs(hold)
    np.testing.assert_allclose(np.abs(np.fft.rfft(period))[k] * 2 / window, expected, rtol=1e-9)


@settings(max_examples=40, deadline=None)
@given(
    window=st.integers(400, 5000),
    low=st.floats(3, 40),
    width=st.floats(30, 900),
    sweep=st.sampled_from(["linear", "logarithmic"]),
)
def test_a_repeated_chirp_is_continuous_at_its_border(window, low, width, sweep):
    rate_hz = 4000.0
    low = max(low, 2 * rate_hz / window)
    period = chirp(low, low + width, rate_hz, window, 2.0, sweep=sweep)
    assert np.max(np.abs(period)) <= 2.0
    # From the last sample to the first is no further than the highest frequency ever goes in a tick; its ends are
    # moved by half a turn in a window for a whole number of turns.
    highest = (low + width + 1.5 * rate_hz / window) * (1.1 if sweep == "logarithmic" else 1)
    assert abs(period[0] - period[-1]) <= 2.0 * 2 * np.pi * highest / rate_hz + 1e-9


@pytest.mark.parametrize("sweep", ["linear", "logarithmic"])
def test_a_chirp_has_its_power_in_its_band_at_every_line(sweep):
    lines = chirp_lines(20, 200, 4000, 4000)
    amplitude = np.abs(np.fft.rfft(chirp(20, 200, 4000, 4000, sweep=sweep))) * 2 / 4000
    assert np.sum(amplitude[list(lines.bins)] ** 2) > 0.97 * np.sum(amplitude**2)
    inner = amplitude[25:196]
    assert inner.min() > 0.1 * inner.max()


def test_a_stepped_sine_is_one_line_at_a_time_and_periodic_as_a_whole():
    lines = Lines.parse("20:60:20", 4000, 400)
    period = stepped_sine(lines, [1.0, 2.0, 3.0], periods=3)
    steps = period.reshape(3, 3, 400)
    for i, k in enumerate(lines.bins):
        spectra = np.abs(np.fft.rfft(steps[i], axis=1)) * 2 / 400
        np.testing.assert_allclose(spectra[:, k], i + 1, rtol=1e-12)
        assert np.all(np.delete(spectra, k, axis=1) < 1e-12)
    whole = stepped_lines(lines, periods=3)
    np.testing.assert_array_equal(whole.frequency_hz, lines.frequency_hz)
    np.testing.assert_allclose(
        np.abs(np.fft.rfft(period))[list(whole.bins)] * 2 / len(period), np.array([1, 2, 3]) / 3, rtol=1e-9
    )


@settings(max_examples=40, deadline=None)
@given(window=st.integers(200, 4000), group=st.integers(2, 6), seed=st.integers(0, 99))
def test_odd_lines_are_odd_and_one_of_each_group_is_a_detection_line(window, group, seed):
    lines = odd_lines(200, 1500, 4000.0, window, group=group, seed=seed)
    assert all(k % 2 for k in lines.bins)
    first, last = lines.frequency_hz[[0, -1]]
    assert first >= 200 - 1e-9
    assert last <= 1500 + 1e-9
    odd = [k for k in range(int(np.ceil(200 * window / 4000 - 1e-9)), int(1500 * window / 4000 + 1e-9) + 1) if k % 2]
    groups = [odd[i : i + group] for i in range(0, len(odd), group)]
    excited = set(lines.bins)
    assert all(len(excited & set(g)) == len(g) - (len(g) == group) for g in groups)
    assert lines == odd_lines(200, 1500, 4000.0, window, group=group, seed=seed)


@settings(max_examples=40, deadline=None)
@given(step=st.floats(1e-4, 0.5), seed=st.integers(0, 99))
def test_quantised_samples_are_multiples_beside_theirs_nearly_all_the_nearest_and_keep_the_mean(step, seed):
    period = multisine(Lines.parse("20:140:20", 4000, 400), phases="random", seed=seed)
    rounded = quantised(period, step)
    np.testing.assert_allclose(rounded / step, np.rint(rounded / step), atol=1e-9)
    off = np.abs(rounded - period)
    assert np.max(off) <= step * (1 + 1e-9)
    assert np.mean(off <= step / 2 * (1 + 1e-9)) > 0.9
    assert abs(np.sum(rounded) - np.sum(period)) <= step / 2 * (1 + 1e-9)


def test_low_crest_phases_keep_amplitudes_and_come_again_from_the_same_seed():
    lines = Lines.parse("20:140:20", 4000, 1600)
    amplitude = np.array([1, 2, 1, 0.5, 3, 1, 1.0])
    first, again = (multisine(lines, amplitude, "low crest", seed=3) for _ in range(2))
    assert np.array_equal(first, again)
    np.testing.assert_allclose(np.abs(np.fft.rfft(first))[list(lines.bins)] * 2 / 1600, amplitude, rtol=1e-12)
    shaken = low_crest_phases(lines.bins, amplitude, starts=4, seed=4)
    assert not np.array_equal(shaken, low_crest_phases(lines.bins, amplitude, starts=4, seed=5))


def test_low_crest_phases_of_many_lines_come_by_the_way_without_a_hessian():
    bins = np.arange(1, 302)
    found = crest_between_samples(bins, 1.0, low_crest_phases(bins, starts=2))
    assert found < 1.5 < crest_between_samples(bins, 1.0, schroeder_phases(301))


def test_the_crest_between_samples_is_that_of_a_dense_grid():
    lines = Lines(tuple(range(1, 8)), 7 * 4096, 1.0)
    phases = schroeder_phases(7)
    dense = multisine(lines, 1.0, phases)
    assert crest_between_samples(lines.bins, 1.0, phases) == pytest.approx(
        np.max(np.abs(dense)) / np.std(dense), rel=4e-4
    )
