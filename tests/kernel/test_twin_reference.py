"""The C kernel and its NumPy twin agree to the bit, but for the sign of zeros."""

import numpy as np
import pytest

from livebode.kernel import SlidingDFT, instruction_sets
from tests.twins.sliding import TwinDFT, twiddles

VARIANTS = ["modulated", "plain", "damped", "hann", "hamming", "blackman"]
SHAPES = [(1, [0]), (2, [1, 0]), (3, [2, 0]), (10, [1, 2, 3]), (11, [0, 5, 10]), (37, range(37)), (64, range(20))]


@pytest.mark.parametrize("instruction_set", instruction_sets())
@pytest.mark.parametrize("dtype", ["float64", "float32"])
@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize(("window", "bins"), SHAPES, ids=lambda v: str(v) if isinstance(v, int) else f"K{len(v)}")
def test_same_bits_as_the_twin(window, bins, variant, dtype, instruction_set, monkeypatch):
    monkeypatch.setenv("LIVEBODE_INSTRUCTION_SET", instruction_set)
    x = np.random.default_rng(window).standard_normal((2, 4 * window + 5)).astype(dtype)
    for hop, phase in ((1, "window"), (1, "fixed"), (3, "window"), (3, "fixed")):
        dft, twin = SlidingDFT(window, bins, 2, dtype, variant), TwinDFT(window, bins, 2, dtype, variant)
        assert np.array_equal(dft.process(x, hop, phase=phase), twin.process(x, hop, phase))
        assert np.array_equal(dft.spectrum(phase), twin.spectrum(phase))


@pytest.mark.parametrize("window", [1, 2, 3, 7, 8, 100, 101, 4096, 4999])
def test_twiddles_are_right_and_mirrored(window):
    cosine, sine = twiddles(window)
    angle = 2 * np.arctan2(np.longdouble(0), np.longdouble(-1)) * np.arange(window) / window
    assert np.abs(cosine - np.cos(angle)).max() < 2.5e-16
    assert np.abs(sine - np.sin(angle)).max() < 2.5e-16
    assert np.array_equal(cosine[1:], cosine[:0:-1])
    assert np.array_equal(sine[1:], np.where(2 * np.arange(1, window) == window, 1, -1) * sine[:0:-1])


def test_the_kernel_recovers_the_twin_twiddles():
    """An impulse at sample 0 leaves each bin's twiddles bare, so the table itself is held against the twin."""
    window = 360
    cosine, sine = twiddles(window)
    x = np.zeros(window)
    x[0] = 1.0
    rows = SlidingDFT(window, [1]).process(x)[:, 0]
    turn = np.arange(1, window + 1) % window
    assert np.array_equal(rows.real, cosine[turn])
    assert np.array_equal(rows.imag, sine[turn])
