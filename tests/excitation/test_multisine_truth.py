"""The multisine is the one that was asked for, to rounding."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Lines
from livebode.excitation import multisine, schroeder_phases


@settings(max_examples=40, deadline=None)
@given(window=st.integers(8, 3000), data=st.data())
def test_every_line_has_its_amplitude_and_phase_and_no_other_bin_has_power(window, data):
    top = (window - 1) // 2
    bins = sorted(data.draw(st.sets(st.integers(1, top), min_size=1, max_size=min(top, 30))))
    rng = np.random.default_rng(window)
    amplitude, phases = rng.uniform(0.1, 2, len(bins)), rng.uniform(-np.pi, np.pi, len(bins))
    period = multisine(Lines(tuple(bins), window, 1000.0), amplitude, phases)
    expected = np.zeros(window // 2 + 1, dtype=complex)
    expected[bins] = amplitude * np.exp(1j * (phases - np.pi / 2))  # a sine is a cosine a quarter turn late
    np.testing.assert_allclose(np.fft.rfft(period) * 2 / window, expected, atol=1e-12)


def test_a_sample_and_the_one_a_period_later_have_the_same_bits():
    twice = Lines((22, 44, 500), 5000, 1000.0)  # the same frequencies, the window doubled
    once = Lines((11, 22, 250), 2500, 1000.0)
    doubled = multisine(twice, phases=[0.3, 0.2, 0.1])
    assert np.array_equal(doubled[:2500], doubled[2500:])
    np.testing.assert_allclose(doubled[:2500], multisine(once, phases=[0.3, 0.2, 0.1]), atol=1e-13)


def crest(period):
    return np.max(np.abs(period)) / np.std(period)


@pytest.mark.parametrize("count", [7, 21, 101, 240])
def test_schroeder_phases_keep_the_crest_factor_low_with_either_sign(count):
    lines = Lines(tuple(range(1, count + 1)), 16 * count, 1000.0)
    paper, classic = multisine(lines), multisine(lines, phases=-schroeder_phases(count))
    assert crest(paper) < 1.92
    # The other sign is the same period backwards, with its sign turned.
    np.testing.assert_allclose(classic[1:], -paper[:0:-1], atol=1e-10)
    assert crest(multisine(lines, phases=np.full(count, np.pi / 2))) == pytest.approx(np.sqrt(2 * count))


def test_schroeder_phases_do_not_depend_on_the_window():
    narrow, wide = Lines.parse("20:140:20", 4000, 200), Lines.parse("20:140:20", 4000, 1000)
    np.testing.assert_allclose(np.tile(multisine(narrow), 5), multisine(wide), atol=1e-12)
