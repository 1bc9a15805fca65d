"""Spectra at a hop are those of the windows, by the sliding DFT and by FFT alike."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from livebode.kernel import HoppingDFT, SlidingDFT

BOUND = {"float64": 5e-15, "float32": 1e-6}


@st.composite
def cases(draw: st.DrawFn) -> dict:
    window = draw(st.sampled_from([1, 2, 7, 30, 101, 256]))
    return {
        "window": window,
        "bins": draw(st.lists(st.integers(0, window - 1), min_size=1, max_size=window, unique=True)),
        "hop": draw(st.sampled_from([1, 3, 30, 300])),
        "channels": draw(st.integers(1, 3)),
        "dtype": draw(st.sampled_from(["float64", "float32"])),
    }


@settings(deadline=None, max_examples=100)
@example({"window": 2, "bins": [1], "hop": 1, "channels": 3, "dtype": "float32"}, [281], "window", 84)
@given(cases(), st.lists(st.integers(0, 400), max_size=4), st.sampled_from(["window", "fixed"]), st.integers(0, 2**32))
def test_rows_are_the_transforms_of_their_windows(case, cuts, phase, seed):
    """Against a DFT of the samples in extended precision, in pieces of any length, zeros before the first."""
    window, hop, bins = case["window"], case["hop"], np.array(case["bins"])
    x = np.random.default_rng(seed).standard_normal((case["channels"], sum(cuts))).astype(case["dtype"])
    dft, pieces = HoppingDFT(**case), np.split(x, np.cumsum(cuts)[:-1] if cuts else [], axis=1)
    rows = np.concatenate([dft.process(piece, phase) for piece in pieces], axis=1)
    ends = np.arange(hop, x.shape[1] + 1, hop)
    assert rows.shape == (case["channels"], len(ends), len(bins))
    assert rows.dtype == SlidingDFT(window, bins, dtype=case["dtype"]).process([0.0]).dtype
    padded = np.concatenate([np.zeros((case["channels"], window)), x], axis=1).astype(np.longdouble)
    step = 2 * np.arctan2(np.longdouble(0), np.longdouble(-1)) / window
    for row, end in enumerate(ends):
        place = np.arange(window) + (end if phase == "fixed" else 0)
        angle = step * (np.outer(place, bins) % window).astype(np.longdouble)
        part = padded[:, end : end + window]
        # A sum that slides keeps the rounding of samples that have left it.
        size = window * np.abs(padded[:, : end + window]).max(axis=1)[:, None]
        error = np.hypot(part @ np.cos(angle) - rows[:, row].real, -(part @ np.sin(angle)) - rows[:, row].imag)
        assert (error <= BOUND[case["dtype"]] * size).all()


def test_the_method_follows_bins_and_hop():
    """Lines of a tracker slide; a full spectrum at a long hop does not."""
    assert not HoppingDFT(400, range(1, 22), hop=20).by_fft
    assert not HoppingDFT(400, range(201), hop=10).by_fft
    assert not HoppingDFT(400, range(201), hop=50).by_fft
    assert HoppingDFT(400, range(201), hop=200).by_fft
    assert HoppingDFT(4096, range(2049), hop=20).by_fft


def test_one_dimension_gives_two():
    assert HoppingDFT(64, range(33), hop=64).process(np.zeros(128)).shape == (2, 33)
    assert HoppingDFT(64, [3], hop=8).process(np.zeros(128)).shape == (16, 1)


@pytest.mark.parametrize("hop", [8, 64])
def test_wrong_arguments_are_refused_by_both_methods(hop):
    dft = HoppingDFT(64, range(33), hop=hop)
    assert dft.by_fft == (hop == 64)
    with pytest.raises(ValueError, match="phase"):
        dft.process(np.zeros(3), "other")
    with pytest.raises(ValueError, match="shape"):
        dft.process(np.zeros((2, 3)))
    with pytest.raises(ValueError, match="hop"):
        HoppingDFT(64, [1], hop=0)
