"""Lines, SNR and transient periods are what was put in, at the stated rates."""

import numpy as np
import pytest

from livebode.core import Lines
from livebode.excitation import find_lines, multisine, recognise
from livebode.excitation._recognise import snr_db
from livebode.excitation.significance import significant

LINES = Lines(tuple(range(11, 251)), 2500, 2500.0)
PERIOD = multisine(LINES)


def complex_noise(rng, shape):
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)


@pytest.mark.parametrize("periods", [2, 3, 5, 20])
def test_noise_gives_no_more_false_lines_than_the_stated_rate(periods):
    """At 5 % for all bins together, 2,000 noise-only recordings give 100 alarms; at most 150, five sigma, may."""
    rng = np.random.default_rng(periods)
    alarms = sum(significant(complex_noise(rng, (periods, 200)), 0.05).any() for _ in range(2000))
    assert alarms <= 150


def test_lines_above_the_noise_are_found_and_no_others():
    """100 recordings of five periods, lines 15 dB above the noise of one period in their bins."""
    rng = np.random.default_rng(0)
    exact = 0
    for _ in range(100):
        spectra = complex_noise(rng, (5, 500))
        spectra[:, 10:200:7] += 10**0.75 * np.exp(2j * np.pi * rng.uniform(size=28))
        exact += np.array_equal(np.flatnonzero(find_lines(spectra).excited), np.arange(10, 200, 7))
    assert exact >= 98


def test_distortion_below_a_step_is_not_excitation_in_a_measured_signal():
    rng = np.random.default_rng(1)
    x = np.tile(PERIOD, 8)
    measured = x + 0.02 * (x / np.std(x)) ** 3 + 1e-3 * rng.standard_normal(x.size)
    found = recognise(measured, 2500)
    assert found.lines.bins == LINES.bins
    assert found.distortion
    assert not set(found.lines.quiet) & set(found.distortion)
    everything = recognise(measured, 2500, gap_db=np.inf)
    assert set(everything.lines.bins) == set(found.lines.bins) | set(found.distortion)


def test_a_reference_keeps_its_weak_lines():
    """30 dB between groups of lines: in a reference, which repeats without noise, they are all design."""
    amplitude = np.where(np.arange(240) < 120, 1.0, 0.03)
    found = recognise(np.tile(multisine(LINES, amplitude), 4), 2500)
    assert found.lines.bins == LINES.bins
    np.testing.assert_allclose(found.amplitude, amplitude, rtol=1e-9)


def test_rounding_of_single_precision_is_not_a_line():
    assert recognise(np.tile(PERIOD, 4).astype(np.float32), 2500).lines.bins == LINES.bins


def test_a_specified_floor_decides_which_lines_count():
    lines = Lines((3, 10, 20), 100, 1000.0)
    x = np.tile(multisine(lines, [1.0, 1.0, 3e-4]), 10)
    assert recognise(x, 1000).lines.bins == (3, 10)
    assert recognise(x, 1000, floor_db=80).lines.bins == (3, 10, 20)


def test_crest_factor_peak_and_rms_of_the_ac_part():
    found = recognise(np.tile(PERIOD, 4) + 7.0, 2500)
    assert found.rms == pytest.approx(np.std(PERIOD), rel=1e-9)
    assert found.peak == pytest.approx(np.max(np.abs(PERIOD)), rel=1e-9)
    assert found.crest_factor == pytest.approx(found.peak / found.rms)


@pytest.mark.parametrize("level_db", [0, 20, 60])
def test_snr_is_the_ratio_that_was_put_in(level_db):
    """Mean over 240 lines and 20 periods within 0.7 dB; at 0 dB the mean's own noise adds 10·log10(1 + 1/20)."""
    rng = np.random.default_rng(level_db)
    spectra = complex_noise(rng, (20, 240)) + 10 ** (level_db / 20)
    assert np.mean(snr_db(spectra)) == pytest.approx(level_db, abs=0.7)


def test_snr_at_the_output_of_a_recording():
    """White noise of variance s² puts 4s²/N into |Y_k|², so lines of amplitude 1 stand at N/(4s²)."""
    rng = np.random.default_rng(4)
    x = np.tile(PERIOD, 20)
    found = recognise(x, 2500, x + 0.5 * rng.standard_normal(x.size) + 3e-5 * np.arange(x.size))
    assert np.median(found.snr_db) == pytest.approx(10 * np.log10(2500 / (4 * 0.25)), abs=0.5)


def test_a_transient_at_the_output_alone_is_found():
    rng = np.random.default_rng(2)
    x = np.tile(PERIOD, 12)
    y = x + 20 * np.exp(-np.arange(x.size) / 300) + 0.05 * rng.standard_normal(x.size)
    assert recognise(x, 2500).transient == ()
    assert recognise(x, 2500, y).transient == (0,)
    assert recognise(x, 2500, y).steady == tuple(range(1, 12))


def test_steady_periods_are_rarely_called_unlike():
    """Stated 1e-3 per recording for Gaussian noise, two distances and two signals: at most 2 of 100 recordings."""
    rng = np.random.default_rng(9)
    x = np.tile(multisine(Lines.parse("20:140:20", 4000, 200)), 20)
    wrong = 0
    for _ in range(100):
        found = recognise(x + 0.3 * rng.standard_normal(x.size), 4000, x + rng.standard_normal(x.size))
        wrong += bool(found.transient or found.outlying)
    assert wrong <= 2
