"""Bad arguments end in one clear sentence that names the value; nothing is half done."""

import numpy as np
import pytest

from livebode.kernel import SlidingDFT


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"window": 0}, "window=0 is not an integer from 1 to 16777216"),
        ({"window": -5}, "window=-5 is not an integer"),
        ({"window": 2.5}, "window=2.5 is not an integer"),
        ({"window": "8"}, "window='8' is not an integer"),
        ({"window": True}, "window=True is not an integer"),
        ({"window": 2**24 + 1}, "window=16777217 is not an integer from 1 to 16777216"),
        ({"window": float("nan")}, "window=nan is not an integer"),
        ({"bins": []}, "is empty: give at least one bin"),
        ({"bins": 3}, "bins=3 is not a sequence of integers"),
        ({"bins": "1,2"}, "bins='1,2' is not a sequence of integers"),
        ({"bins": [1.5]}, "bin 1.5 is not an integer from 0 to 7, as window=8 has"),
        ({"bins": [1, 8]}, "bin 8 is not an integer from 0 to 7"),
        ({"bins": [-1]}, "bin -1 is not an integer from 0 to 7"),
        ({"bins": [1, 2, 1]}, "bin 1 is duplicated"),
        ({"bins": [None]}, "bin None is not an integer"),
        ({"bins": [[1, 2]]}, "is not an integer"),
        ({"channels": 0}, "channels=0 is not an integer from 1 to 1024"),
        ({"channels": 1025}, "channels=1025 is not an integer"),
        ({"dtype": "complex128"}, "dtype='complex128' is neither float32 nor float64"),
        ({"dtype": "float16"}, "is neither float32 nor float64"),
        ({"dtype": "nonsense"}, "is neither float32 nor float64"),
        ({"variant": "hanning"}, "variant='hanning' is not one of modulated, plain"),
        ({"variant": 1}, "variant=1 is not one of"),
        ({"damping": 0.5}, "damping=0.5 is for variant='damped' only"),
        ({"damping": 1.0, "variant": "damped"}, "damping=1.0 is not a number between 0 and 1"),
        ({"damping": "x", "variant": "damped"}, "is not a number between 0 and 1"),
        ({"hop": 3}, "hop=3 does not divide window=8"),
        ({"hop": 16}, "hop=16 does not divide window=8"),
        ({"hop": 4, "variant": "hann"}, "hop=4 is for variant='modulated' only"),
    ],
)
def test_bad_arguments_of_the_constructor_are_refused(arguments, sentence):
    with pytest.raises(ValueError, match=r"^[^\n]*$") as caught:
        SlidingDFT(**{"window": 8, "bins": [1, 2], **arguments})
    assert sentence in str(caught.value)


def test_misspelt_keywords_are_refused():
    with pytest.raises(TypeError):
        SlidingDFT(8, [1], chanels=2)
    with pytest.raises(TypeError):
        SlidingDFT(8, [1]).process([1.0], hops=2)


def test_integral_floats_count_as_integers():
    assert SlidingDFT(8.0, np.array([1.0, 2.0])).bins.tolist() == [1, 2]


@pytest.mark.parametrize(
    ("channels", "x", "sentence"),
    [
        (1, np.zeros((2, 5)), r"x has shape (2, 5) where (samples,) or (1, samples) is needed"),
        (2, np.zeros(5), r"x has shape (5,) where (2, samples) is needed"),
        (2, np.zeros((5, 2)), "transpose it"),
        (1, 3.0, "x has shape ()"),
        (1, np.zeros(4, complex), "x has dtype complex128, which is not real"),
        (1, ["a", "b"], "which is not real"),
        (1, [None, 1.0], "x has dtype object, which is not real"),
        (2, [[1.0, 2.0], [3.0]], "rows of different lengths"),
        (1, b"12345678", "which is not real"),
    ],
)
def test_bad_samples_are_refused(channels, x, sentence):
    dft = SlidingDFT(8, [1], channels)
    for call in (dft.process, dft.advance):
        with pytest.raises(ValueError, match=r"^[^\n]*$") as caught:
            call(x)
        assert sentence in str(caught.value)
    assert dft.count == 0


@pytest.mark.parametrize(
    ("channels", "x", "sentence"),
    [
        (1, [1.0, 2.0], "a sample of shape (2,) was pushed; give a number"),
        (2, 1.0, "a sample of shape () was pushed; give 2 numbers, one a channel"),
        (2, [1.0], "give 2 numbers"),
        (2, [1.0, "x"], "which is not real"),
        (1, "x", "which is not real"),
        (1, 1j, "which is not real"),
    ],
)
def test_bad_pushed_samples_are_refused(channels, x, sentence):
    dft = SlidingDFT(8, [1], channels)
    with pytest.raises(ValueError, match=r"^[^\n]*$") as caught:
        dft.push(x)
    assert sentence in str(caught.value)
    assert dft.count == 0


@pytest.mark.parametrize("hop", [0, -1, 1.5, "2", True, -(2**70)])
def test_a_bad_hop_is_refused(hop):
    with pytest.raises(ValueError, match="is not an integer ≥ 1"):
        SlidingDFT(8, [1]).process(np.zeros(4), hop)
    with pytest.raises(ValueError, match="is not an integer ≥ 1"):
        SlidingDFT(8, [1], hop=hop)


@pytest.mark.parametrize("power", [63, 64, 20_000])
def test_a_hop_that_no_computer_counts_to_is_refused(power):
    with pytest.raises(ValueError, match="hop is larger than 9223372036854775807 samples; give a smaller one"):
        SlidingDFT(8, [1]).process(np.zeros(4), 2**power)


def test_hop_may_be_larger_than_the_block_and_any_kind_of_integer():
    dft = SlidingDFT(8, [1])
    assert dft.process(np.zeros(40), 2**62).shape == (0, 1)
    assert dft.process(np.zeros(40), np.int32(40)).shape == (1, 1)
    assert dft.process(np.zeros(40), 40.0).shape == (1, 1)


@pytest.mark.parametrize("phase", ["windows", "", None, 1])
def test_an_unknown_phase_is_refused(phase):
    dft = SlidingDFT(8, [1])
    with pytest.raises(ValueError, match="is neither 'window' nor 'fixed'"):
        dft.process(np.zeros(4), phase=phase)
    with pytest.raises(ValueError, match="is neither 'window' nor 'fixed'"):
        dft.spectrum(phase)
    assert dft.count == 0


def _read_only() -> np.ndarray:
    z = np.zeros((4, 2), complex)
    z.flags.writeable = False
    return z


@pytest.mark.parametrize(
    ("out", "sentence"),
    [
        (np.zeros((4, 3), complex), "it is complex128 of shape (4, 3)"),
        (np.zeros((3, 2), complex), "shape (4, 2)"),
        (np.zeros((1, 4, 2), complex), "it is complex128 of shape (1, 4, 2)"),
        (np.zeros((4, 2), np.complex64), "it is complex64"),
        (np.zeros((4, 4)), "it is float64"),
        (np.zeros((4, 2), complex, order="F"), "not contiguous"),
        (np.zeros((8, 2), complex)[::2], "not contiguous"),
        (np.zeros((4, 2), np.dtype(complex).newbyteorder()), "out must be a writable C-contiguous complex128"),
        (_read_only(), "not writable"),
        ([[0j, 0j]] * 4, "it is a list"),
    ],
)
def test_a_bad_output_array_is_refused(out, sentence):
    dft = SlidingDFT(8, [1, 2])
    with pytest.raises(ValueError, match=r"^[^\n]*$") as caught:
        dft.process(np.ones(4), out=out)
    assert sentence in str(caught.value)
    assert dft.count == 0


def test_an_output_array_that_shares_memory_with_the_input_is_refused():
    memory = np.zeros(64)
    with pytest.raises(ValueError, match="shares memory with x"):
        SlidingDFT(8, [1]).process(memory[6:10], out=memory[:8].view(complex).reshape(4, 1))


def test_too_much_memory_is_refused_in_words():
    with pytest.raises((ValueError, MemoryError)):
        SlidingDFT(2**24, range(2**20), channels=1024)
