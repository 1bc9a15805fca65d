"""The variants to compare with are what their names say."""

import numpy as np
import pytest
from scipy.signal import get_window

from livebode.kernel import SlidingDFT

N, BINS = 40, [0, 1, 7, 20, 39]


@pytest.fixture
def x() -> np.ndarray:
    return np.random.default_rng(1).standard_normal(5 * N + 3)


@pytest.mark.parametrize("name", ["hann", "hamming", "blackman"])
def test_windows_are_exactly_the_periodic_windows(name, x):
    truth = np.fft.fft(get_window(name, N) * x[-N:])[BINS]
    dft = SlidingDFT(N, BINS, variant=name)
    assert np.allclose(dft.process(x, 1)[-1], truth, rtol=0, atol=1e-12)
    assert np.allclose(dft.spectrum(), truth, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["hann", "hamming", "blackman", "plain"])
def test_fixed_phase_differs_by_the_turn_of_the_period(name, x):
    dft = SlidingDFT(N, BINS, variant=name)
    dft.advance(x)
    turn = np.exp(-2j * np.pi * (len(x) * np.array(BINS) % N) / N)
    assert np.allclose(dft.spectrum("fixed"), dft.spectrum() * turn, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["hann", "hamming", "blackman"])
@pytest.mark.parametrize("window", [2, 3, 4])
def test_windows_wrap_round_where_there_are_fewer_bins_than_taps(name, window):
    x = np.random.default_rng(window).standard_normal(3 * window)
    dft = SlidingDFT(window, range(window), variant=name)
    dft.advance(x)
    assert np.allclose(dft.spectrum(), np.fft.fft(get_window(name, window) * x[-window:]), rtol=0, atol=1e-13)


def test_plain_is_the_dft(x):
    dft = SlidingDFT(N, BINS, variant="plain")
    assert np.allclose(dft.process(x, 1)[-1], np.fft.fft(x[-N:])[BINS], rtol=0, atol=1e-12)


def test_damped_is_the_dft_of_the_forgetting_window(x):
    r = 0.98
    weights = r ** np.arange(N)[::-1]
    dft = SlidingDFT(N, BINS, variant="damped", damping=r)
    dft.advance(x)
    assert np.allclose(dft.spectrum(), np.fft.fft(weights * x[-N:])[BINS], rtol=0, atol=1e-12)


def test_damped_forgets_a_spike(x):
    spiked = np.concatenate([x[:100], [1e9], x[100:], np.zeros(20 * N)])
    plain, damped = (SlidingDFT(N, [7], variant=v, **a) for v, a in (("plain", {}), ("damped", {"damping": 0.95})))
    for dft in (plain, damped):
        dft.advance(spiked)
    assert abs(damped.spectrum()) < 1e-12 < abs(plain.spectrum())
