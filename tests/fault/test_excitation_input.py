"""Bad recordings are refused in one sentence with the value and the remedy."""

import contextlib

import numpy as np
import pytest

from livebode.core import InputError, Lines
from livebode.excitation import multisine, recognise

GOOD = np.tile(multisine(Lines.parse("20:140:20", 4000, 200)), 5)


@pytest.mark.parametrize(
    ("excitation", "sentence"),
    [
        ([], "the excitation is empty"),
        (np.full(100, 3.5), "constant at 3.5; choose the channel"),
        (np.full(100, np.nan), "no finite sample among 100"),
        (np.full(100, np.inf), "no finite sample among 100"),
        ([np.nan, 2.0, np.nan], "constant at 2"),
        (np.ones((3, 5)), r"shape \(3, 5\); give one channel"),
        (["a", "b"], "cannot be read as numbers"),
        ([1.0, 2.0, 1.0], "3 samples are too few"),
        ([1.0, 2.0, 1.0, 2.0, 1.0, 3.0, 1.0], "does not repeat within 3 samples"),
        (np.random.default_rng(0).standard_normal(5000), "does not repeat within 2500 samples.*record at least two"),
    ],
)
def test_refused(excitation, sentence):
    with pytest.raises(InputError, match=sentence):
        recognise(excitation, 1000)


@pytest.mark.parametrize("rate_hz", [0, -1, np.nan, np.inf])
def test_rate(rate_hz):
    with pytest.raises(InputError, match=r"rate_hz=.* is not a positive number"):
        recognise(GOOD, rate_hz)


def test_output():
    with pytest.raises(InputError, match="the output has 999 samples and the excitation 1000"):
        recognise(GOOD, 4000, GOOD[:-1])
    with pytest.raises(InputError, match="the output is constant at 0"):
        recognise(GOOD, 4000, np.zeros_like(GOOD))


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"phases": "newman"}, "phases='newman' is not known"),
        ({"amplitude": [1.0, 2.0]}, r"amplitude has shape \(2,\) for 7 lines"),
        ({"phases": [0.0]}, r"phases has shape \(1,\) for 7 lines"),
        ({"amplitude": np.nan}, "amplitude=nan is not finite"),
    ],
)
def test_multisine(arguments, sentence):
    with pytest.raises(InputError, match=sentence):
        multisine(Lines.parse("20:140:20", 4000, 200), **arguments)


@pytest.mark.parametrize("length", range(6, 60))
def test_short_recordings_of_noise_never_crash(length):
    rng = np.random.default_rng(length)
    for x in (rng.standard_normal(length), np.sign(rng.standard_normal(length)), np.arange(length) % 2):
        with contextlib.suppress(InputError):
            assert recognise(x, 1000).periods >= 2


@pytest.mark.parametrize("scale", [1e-150, 1e-30, 1e30, 1e150])
def test_the_unit_does_not_matter(scale):
    """Squares of squares would leave the range of float64; a recording in pm or in GN is still a recording."""
    found = recognise(scale * GOOD, 4000)
    assert (found.period, found.lines.bins) == (200, (1, 2, 3, 4, 5, 6, 7))
    np.testing.assert_allclose(found.amplitude / scale, 1, atol=1e-9)


def test_the_input_is_left_as_it_was():
    x = GOOD.copy()
    x[5] = np.nan
    before = x.copy()
    recognise(x, 4000, x)
    np.testing.assert_array_equal(x, before)
