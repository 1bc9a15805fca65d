"""Any way of cutting the same samples gives the same bits."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.kernel import SlidingDFT, instruction_sets

VARIANTS = ["modulated", "modulated", "modulated", "hann", "blackman", "plain", "damped"]


@st.composite
def configurations(draw: st.DrawFn) -> dict:
    window = draw(st.one_of(st.integers(1, 12), st.sampled_from([64, 100, 129, 257])))
    bins = draw(st.lists(st.integers(0, window - 1), min_size=1, max_size=40, unique=True))
    return {
        "window": window,
        "bins": bins,
        "channels": draw(st.integers(1, 3)),
        "dtype": draw(st.sampled_from(["float64", "float32"])),
        "variant": draw(st.sampled_from(VARIANTS)),
    }


# What is done with the next samples: a block, single pushes, a block without rows, or a move to a fresh object.
pieces = st.lists(
    st.tuples(st.sampled_from(["process", "push", "advance", "move", "read"]), st.integers(0, 150)), max_size=12
)


def bits(z: np.ndarray) -> bytes:
    return np.ascontiguousarray(z).tobytes()


@settings(deadline=None, max_examples=150)
@given(configurations(), pieces, st.integers(1, 30), st.sampled_from(["window", "fixed"]), st.randoms())
def test_blocks_pushes_hops_and_moves_give_the_same_bits(configuration, cuts, hop, phase, random):
    channels = configuration["channels"]
    rng = np.random.default_rng(random.randrange(2**32))
    length = sum(n for _, n in cuts)
    x = rng.standard_normal((channels, length)).astype(configuration["dtype"])
    dense = SlidingDFT(**configuration).process(x, 1, phase=phase)
    dft, at = SlidingDFT(**configuration), 0
    for what, n in cuts:
        block, start, at = x[:, at : at + n], at, at + n
        if what == "process":
            rows = dft.process(block, hop, phase=phase)
            due = [i for i in range(start, at) if (i + 1) % hop == 0]
            assert bits(rows) == bits(dense[:, due])
        elif what == "advance":
            dft.advance(block)
        else:
            for sample in block.T:
                dft.push(sample if channels > 1 else float(sample[0]))
        if what == "move":
            other = SlidingDFT(**configuration)
            other.restore(dft.snapshot())
            assert other.snapshot() == dft.snapshot()
            dft = other
        assert dft.count == at
        if what == "read" and at:
            assert bits(np.atleast_2d(dft.spectrum(phase))) == bits(dense[:, at - 1])
    if at:
        assert bits(np.atleast_2d(dft.spectrum(phase))) == bits(dense[:, -1])


@settings(deadline=None, max_examples=60)
@given(configurations(), st.integers(1, 40), st.randoms())
def test_instruction_sets_give_the_same_bits_and_snapshots(configuration, hop, random):
    import os

    rng = np.random.default_rng(random.randrange(2**32))
    x = rng.standard_normal((configuration["channels"], 300)).astype(configuration["dtype"])
    results = []
    before = os.environ.get("LIVEBODE_INSTRUCTION_SET")
    try:
        for name in instruction_sets():
            os.environ["LIVEBODE_INSTRUCTION_SET"] = name
            dft = SlidingDFT(**configuration)
            results.append((bits(dft.process(x, hop)), dft.snapshot()))
    finally:
        if before is None:
            os.environ.pop("LIVEBODE_INSTRUCTION_SET", None)
        else:
            os.environ["LIVEBODE_INSTRUCTION_SET"] = before
    assert all(result == results[0] for result in results)


def test_a_reset_kernel_equals_a_new_one():
    dft = SlidingDFT(50, [1, 2], 2)
    fresh = dft.snapshot()
    dft.advance(np.ones((2, 333)))
    dft.reset()
    assert dft.count == 0
    assert np.array_equal(dft.process(np.ones((2, 77))), SlidingDFT(50, [1, 2], 2).process(np.ones((2, 77))))
    dft.reset()
    assert dft.snapshot() == fresh
