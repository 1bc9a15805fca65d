"""Spectra at a hop of their own: exact within rounding, the same bits however the samples are cut, and healed."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.kernel import SlidingDFT, instruction_sets
from tests.twins.hop import TwinHopDFT

BOUND = {"float64": 5e-15, "float32": 1e-6}  # of √N·‖x‖₂ of the window


@st.composite
def configurations(draw: st.DrawFn) -> dict:
    hop = draw(st.one_of(st.integers(1, 12), st.sampled_from([16, 20, 33, 100, 127, 128, 129, 200])))
    window = hop * draw(st.integers(1, 9))
    return {
        "window": window,
        "bins": draw(st.lists(st.integers(0, window - 1), min_size=1, max_size=40, unique=True)),
        "channels": draw(st.integers(1, 3)),
        "dtype": draw(st.sampled_from(["float64", "float32"])),
        "hop": hop,
    }


def noise(configuration: dict, length: int, seed: int) -> np.ndarray:
    x = np.random.default_rng(seed).standard_normal((configuration["channels"], length))
    return x.astype(configuration["dtype"])


def bits(z: np.ndarray) -> bytes:
    return np.ascontiguousarray(z).tobytes()


def exact(window: np.ndarray, k: int, first: int) -> complex:
    """Σ x·e^(−2πik(first + i)/N) in extended precision, of angles that are reduced as integers."""
    size = len(window)
    turn = 2 * np.arctan2(np.longdouble(0), np.longdouble(-1)) / size
    angle = turn * (k * (first + np.arange(size)) % size).astype(np.longdouble)
    x = window.astype(np.longdouble)
    return complex(float(x @ np.cos(angle)), float(-(x @ np.sin(angle))))


@settings(deadline=None, max_examples=80)
@given(configurations(), st.sampled_from(["window", "fixed"]), st.floats(-1e4, 1e4), st.integers(0, 2**32))
def test_rows_are_the_transforms_of_their_windows(configuration, phase, offset, seed):
    window, hop, bins = configuration["window"], configuration["hop"], configuration["bins"]
    x = (noise(configuration, 3 * window + hop, seed) + offset).astype(configuration["dtype"])
    rows = SlidingDFT(**configuration).process(x, phase=phase)
    padded = np.concatenate([np.zeros((len(x), window)), x], axis=1)
    assert rows.shape == (len(x), x.shape[1] // hop, len(bins))
    for row in {0, rows.shape[1] // 2, rows.shape[1] - 1}:
        end = (row + 1) * hop
        for channel, part in enumerate(padded[:, end : end + window]):
            first = end % window if phase == "fixed" else 0
            truth = [exact(part, k, first) for k in bins]
            # A sum that slides keeps the rounding of samples that have left it until it is renewed.
            size = np.sqrt(window) * np.linalg.norm(padded[channel, max(0, end - window) : end + window])
            assert np.abs(rows[channel, row] - truth).max() <= BOUND[configuration["dtype"]] * size


ACTIONS = ["process", "strided", "push", "advance", "move", "read"]
pieces = st.lists(st.tuples(st.sampled_from(ACTIONS), st.integers(0, 300)), max_size=8)


@settings(deadline=None, max_examples=120)
@given(configurations(), pieces, st.integers(1, 3), st.sampled_from(["window", "fixed"]), st.integers(0, 2**32))
def test_blocks_pushes_and_moves_give_the_same_bits(configuration, cuts, every, phase, seed):
    hop, channels = configuration["hop"], configuration["channels"]
    x = noise(configuration, sum(n for _, n in cuts), seed)
    all_rows = SlidingDFT(**configuration).process(x, phase=phase)
    dft, at = SlidingDFT(**configuration), 0
    for what, n in cuts:
        block, start, at = x[:, at : at + n], at, at + n
        if what in ("process", "strided"):
            due = [i // hop for i in range(start, at) if (i + 1) % (every * hop) == 0]
            samples = np.asfortranarray(block) if what == "strided" else block
            assert bits(dft.process(samples, every * hop, phase=phase)) == bits(all_rows[:, due])
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
        if what == "read" and at >= hop:
            assert bits(np.atleast_2d(dft.spectrum(phase))) == bits(all_rows[:, at // hop - 1])
    whole = SlidingDFT(**configuration)
    whole.advance(x)
    assert dft.snapshot() == whole.snapshot()


@pytest.mark.parametrize("instruction_set", instruction_sets())
@settings(deadline=None, max_examples=25)
@given(configurations(), st.sampled_from(["window", "fixed"]), st.integers(0, 2**32))
def test_each_instruction_set_has_the_bits_of_the_twin(instruction_set, configuration, phase, seed):
    x = noise(configuration, 2 * configuration["window"] + configuration["hop"], seed)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LIVEBODE_INSTRUCTION_SET", instruction_set)
        dft = SlidingDFT(**configuration)
    assert np.array_equal(dft.process(x, phase=phase), TwinHopDFT(**configuration).process(x, phase))


@settings(deadline=None, max_examples=60)
@given(configurations(), st.sampled_from([np.nan, np.inf, -np.inf, 1e30]), st.integers(0, 2**32))
def test_a_bad_sample_is_seen_and_gone_in_less_than_two_windows(configuration, bad, seed):
    window, hop = configuration["window"], configuration["hop"]
    clean = noise(configuration, 5 * window, seed)
    place = window + seed % window
    x = clean.copy()
    x[0, place] = bad
    before, after = SlidingDFT(**configuration).process(clean), SlidingDFT(**configuration).process(x)
    first, healed = place // hop, -(-(place // window + 2) * window // hop) - 1
    assert bits(after[:, :first]) == bits(before[:, :first])
    if not np.isfinite(bad):
        marked = ~np.isfinite(after[0, first : first + window // hop])
        assert marked.any(axis=1).all(), "a window with a bad sample must not look like a result"
    size = np.sqrt(window) * np.linalg.norm(clean, axis=1)[:, np.newaxis, np.newaxis]
    assert (np.abs(after - before)[:, healed:] <= BOUND[configuration["dtype"]] * size).all()
    assert bits(after[1:]) == bits(before[1:])


@settings(deadline=None, max_examples=40)
@given(configurations(), st.booleans(), st.sampled_from(["window", "fixed"]), st.integers(0, 7), st.integers(0, 2**32))
def test_nothing_around_the_rows_is_written(configuration, any_sample, phase, shift, seed):
    """Rows at the hop, and without one after every sample."""
    configuration["channels"] = 1
    if any_sample:
        configuration["hop"] = None
    x, bins = noise(configuration, 3 * configuration["window"], seed)[0], len(configuration["bins"])
    expected = SlidingDFT(**configuration).process(x, phase=phase)
    around = np.full(expected.size + 48, 7.0, expected.dtype)
    out = around[shift : shift + expected.size].reshape(-1, bins)
    SlidingDFT(**configuration).process(x, None, out, phase)
    assert np.array_equal(out, expected)
    assert (around[:shift] == 7).all()
    assert (around[shift + out.size :] == 7).all()


def test_error_stays_flat_over_a_million_samples():
    dft, errors, rng = SlidingDFT(2000, [1, 40, 500], hop=20), [], np.random.default_rng(5)
    for _ in range(10):
        x = 100 + rng.standard_normal(100_000)
        dft.advance(x)
        truth = np.fft.fft(x[-2000:])[[1, 40, 500]]
        errors.append(np.abs(dft.spectrum() - truth).max() / np.sqrt(2000) / np.linalg.norm(x[-2000:]))
    assert max(errors) <= BOUND["float64"]
    assert max(errors[5:]) <= 4 * max(errors[:5]), "the error grows"


def test_quarter_turns_are_exact():
    """Their factors are 0 and ±1, so the spectra of small integers have no error, in rational arithmetic."""
    x = np.random.default_rng(1).integers(-8, 9, 64)
    rows = SlidingDFT(4, [0, 1, 2, 3], hop=1).process(x.astype(float), phase="fixed")
    quarter = {0: (1, 0), 1: (0, -1), 2: (-1, 0), 3: (0, 1)}
    for row in range(3, len(rows)):
        for k in range(4):
            parts = [quarter[k * n % 4] for n in range(row - 3, row + 1)]
            window = [Fraction(int(v)) for v in x[row - 3 : row + 1]]
            truth = [sum(v * part[i] for v, part in zip(window, parts)) for i in (0, 1)]
            assert rows[row, k] == complex(*map(float, truth))


def test_rows_at_another_hop_and_a_snapshot_of_another_are_refused():
    dft = SlidingDFT(60, [1, 2], hop=20)
    with pytest.raises(ValueError, match="hop is not a multiple"):
        dft.process(np.zeros(60), 30)
    with pytest.raises(ValueError, match="hop is not a multiple"):
        dft.process(np.zeros(60), 1)
    assert dft.count == 0
    for other in (SlidingDFT(60, [1, 2]), SlidingDFT(60, [1, 2], hop=30)):
        with pytest.raises(ValueError, match="variant or hop"):
            dft.restore(other.snapshot())
