"""FB_SlidingDft, parsed by blark and run, against the C kernel: the same bits."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.core import Lines
from livebode.kernel import SlidingDFT
from livebode_drives.structured_text.sliding_dft import sliding_dft
from tools.structured_text import Instance, Machine


def block(window: int, bins: list[int], channels: list[str], phase: str = "fixed") -> Instance:
    """A block whose table is filled, as N idle cycles leave it."""
    lines = Lines(tuple(bins), window, rate_hz=4000.0)
    found = Machine(sliding_dft(lines, channels, phase=phase)).instance("FB_SlidingDft")
    for _ in range(window):
        found(**dict.fromkeys(channels, 1.0))
    assert found["count"] == 0
    return found


def pushed(dft: Instance, channels: list[str], sample: np.ndarray) -> np.ndarray:
    dft(**dict(zip(channels, sample.tolist())))
    return np.stack([dft["re"], dft["im"]], axis=-1).view(np.complex128)[..., 0]


@pytest.mark.parametrize(
    ("window", "bins", "phase"),
    [
        (400, range(1, 22), "fixed"),
        (37, [1, 5, 18], "window"),
        (50, [1, 24], "window"),
        (3, [1], "fixed"),
    ],
)
def test_every_output_over_ten_periods_is_the_kernels_to_the_bit(window: int, bins: list[int], phase: str) -> None:
    channels = ["w", "y"]
    x = np.random.default_rng(window).standard_normal((2, 10 * window)) * [[1.0], [1e3]] + [[0.0], [1e4]]
    dft = block(window, list(bins), channels, phase)
    expected = SlidingDFT(window, list(bins), channels=2).process(x, phase=phase)
    for n, sample in enumerate(x.T):
        np.testing.assert_array_equal(pushed(dft, channels, sample), expected[:, n])
        assert dft["valid"] == (n + 1 >= window)
    assert dft["count"] == 10 * window


def test_the_block_is_the_dft_of_the_last_window_after_2000_periods() -> None:
    """Against numpy.fft, within the kernel's own bound of 5e-15·√N·‖x‖₂, after 2,000 periods with an offset."""
    window, bins = 50, [1, 24]
    dft = block(window, bins, ["w", "y"], "window")
    x = 100.0 + np.random.default_rng(1).standard_normal((2, 2000 * window))
    for sample in x.T[:-1]:
        dft(w=float(sample[0]), y=float(sample[1]))
    found = pushed(dft, ["w", "y"], x[:, -1])
    last = x[:, -window:]
    bound = 5e-15 * np.sqrt(window) * np.linalg.norm(last, axis=1)
    assert np.all(np.abs(found - np.fft.fft(last)[:, bins]).max(axis=1) <= bound)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e300])
def test_a_bad_sample_is_forgotten_within_two_windows(bad: float) -> None:
    window, bins = 37, [1, 5, 18]
    dft = block(window, bins, ["w", "y"], "window")
    x = np.random.default_rng(2).standard_normal((2, 5 * window))
    x[1, window + 3] = bad
    expected = SlidingDFT(window, bins, channels=2).process(x)
    for n, sample in enumerate(x.T):
        found = pushed(dft, ["w", "y"], sample)
        np.testing.assert_array_equal(found, expected[:, n])
        if n >= 3 * window + 3:
            np.testing.assert_allclose(found, np.fft.fft(x[:, n - window + 1 : n + 1])[:, bins], atol=1e-12)
