"""Bad recordings are refused in one sentence with the value and the remedy."""

import contextlib

import numpy as np
import pytest

from livebode.core import Lines, LivebodeError, SignalError, UsageError
from livebode.excitation import multisine, recognise
from tests.support.errors import refused

GOOD = np.tile(multisine(Lines.parse("20:140:20", 4000, 200)), 5)


@pytest.mark.parametrize(
    ("excitation", "kind", "code"),
    [
        ([], SignalError, "empty"),
        (np.full(100, 3.5), SignalError, "channel-constant"),
        (np.full(100, np.nan), SignalError, "channel-empty"),
        (np.full(100, np.inf), SignalError, "channel-empty"),
        ([np.nan, 2.0, np.nan], SignalError, "channel-constant"),
        (np.arange(100.0), SignalError, "no-excitation"),
        (np.ones((3, 5)), UsageError, "wrong-shape"),
        (["a", "b"], UsageError, "unreadable"),
        ([1.0, 2.0, 1.0], SignalError, "too-short"),
        ([1.0, 2.0, 1.0, 2.0, 1.0, 3.0, 1.0], SignalError, "not-periodic"),
        (np.random.default_rng(0).standard_normal(5000), SignalError, "not-periodic"),
    ],
)
def test_recordings_without_a_periodic_excitation_are_refused(excitation, kind, code):
    with refused(kind, code):
        recognise(excitation, 1000)


@pytest.mark.parametrize("rate_hz", [0, -1, np.nan, np.inf])
def test_a_rate_out_of_range_is_refused(rate_hz):
    with refused(UsageError, "out-of-range", argument="rate_hz"):
        recognise(GOOD, rate_hz)


def test_an_output_of_another_length_or_without_signal_is_refused():
    with refused(UsageError, "wrong-shape", samples=999, excitation_samples=1000):
        recognise(GOOD, 4000, GOOD[:-1])
    with refused(SignalError, "channel-constant", role="output", value=0.0):
        recognise(GOOD, 4000, np.zeros_like(GOOD))


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ({"phases": "newman"}, "not-one-of"),
        ({"amplitude": [1.0, 2.0]}, "wrong-shape"),
        ({"phases": [0.0]}, "wrong-shape"),
        ({"amplitude": np.nan}, "not-finite"),
    ],
)
def test_multisines_out_of_range_are_refused(arguments, code):
    with refused(UsageError, code, argument=next(iter(arguments))):
        multisine(Lines.parse("20:140:20", 4000, 200), **arguments)


@pytest.mark.parametrize("length", range(6, 60))
def test_short_recordings_of_noise_never_crash(length):
    rng = np.random.default_rng(length)
    for x in (rng.standard_normal(length), np.sign(rng.standard_normal(length)), np.arange(length) % 2):
        with contextlib.suppress(LivebodeError):
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
