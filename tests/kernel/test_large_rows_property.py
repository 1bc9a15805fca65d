"""Rows of more than the caches hold, which are written past them, are the rows of small blocks."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.kernel import SlidingDFT, instruction_sets

BYTES = 12 << 20  # LB_STAGED_BYTES of kernel/src/stage.h


@st.composite
def configurations(draw: st.DrawFn) -> dict:
    window = draw(st.sampled_from([50, 129, 1000]))
    count = draw(st.one_of(st.integers(4, min(window, 60)), st.integers(min(window, 200), min(window, 540))))
    return {
        "window": window,
        "bins": list(range(window - count, window)),
        "channels": draw(st.integers(1, 3)),
        "dtype": draw(st.sampled_from(["float64", "float32"])),
    }


@pytest.mark.parametrize("instruction_set", instruction_sets())
@settings(deadline=None, max_examples=6)
@given(configurations(), st.integers(0, 7), st.sampled_from(["window", "fixed"]))
def test_large_blocks_have_the_bits_of_small_ones(instruction_set, configuration, shift, phase):
    """At every alignment of the output; neither a row nor what surrounds the output is changed by a write too many."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LIVEBODE_INSTRUCTION_SET", instruction_set)
        large, small = SlidingDFT(**configuration), SlidingDFT(**configuration)
    channels, bins = configuration["channels"], len(configuration["bins"])
    kind = np.complex128 if configuration["dtype"] == "float64" else np.complex64
    rows = BYTES // (channels * bins * kind().itemsize) + 1 + shift
    x = np.random.default_rng(rows).standard_normal((channels, rows)).astype(configuration["dtype"])
    around = np.full(channels * rows * bins + 16, 7.0, kind)
    out = around[shift : shift + channels * rows * bins].reshape(
        (channels, rows, bins) if channels > 1 else (rows, bins)
    )
    large.process(x if channels > 1 else x[0], 1, out, phase)
    assert (around[:shift] == 7).all()
    assert (around[shift + out.size :] == 7).all()
    for at in range(0, rows, rows // 7):
        block = x[:, at : at + rows // 7]
        expected = small.process(block if channels > 1 else block[0], 1, phase=phase)
        assert np.array_equal(out[..., at : at + rows // 7, :], expected)
    assert large.snapshot() == small.snapshot()
