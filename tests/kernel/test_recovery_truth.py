"""A bad sample is gone in less than 2N samples, and leaves nothing behind."""

import numpy as np
import pytest

from livebode.kernel import SlidingDFT

BAD = [np.nan, np.inf, -np.inf, 1e6, 1e30]


@pytest.mark.parametrize("dtype", ["float64", "float32"])
@pytest.mark.parametrize("bad", BAD)
@pytest.mark.parametrize("window", [1, 2, 20, 31])
def test_bad_sample_is_gone_in_less_than_two_windows(window, bad, dtype):
    bins = sorted({0, window // 3, window // 2})
    rng = np.random.default_rng(window)
    clean = rng.standard_normal(6 * window).astype(dtype)
    want = SlidingDFT(window, bins, dtype=dtype).process(clean)
    for place in range(window):
        x = clean.copy()
        x[2 * window + place] = bad
        got = SlidingDFT(window, bins, dtype=dtype).process(x)
        healed = 2 * window + place + 2 * window - 1  # this row has seen fewer than 2N samples since
        scale = np.sqrt(window) * np.linalg.norm(clean) * (1e-6 if dtype == "float32" else 5e-15)
        assert np.abs(got[healed:] - want[healed:]).max() <= scale
        assert np.isfinite(got[: 2 * window + place]).all()


def test_rows_of_a_window_with_nan_are_nan():
    x = np.ones(100)
    x[30] = np.nan
    rows = SlidingDFT(20, [0, 3]).process(x)
    assert np.isnan(rows[30:50]).any(axis=1).all(), "a window with a NaN must not look like a result"


def test_variants_that_never_renew_keep_a_spike():
    """What the renewal is for: the paper's recursion (4) still carries what a spike rounded away."""
    x = np.random.default_rng(0).standard_normal(2000)
    x[100] = 1e12
    truth = np.fft.fft(x[-50:])[[3]]
    plain, modulated = (SlidingDFT(50, [3], variant=v) for v in ("plain", "modulated"))
    for dft in (plain, modulated):
        dft.advance(x)
    assert abs(modulated.spectrum() - truth) < 1e-12
    assert abs(plain.spectrum() - truth) > 1e-6
