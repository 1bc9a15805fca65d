"""The public face of the excitation folder."""

import dataclasses

import numpy as np
import pytest

from livebode import excitation
from livebode.core import Lines

FOUND = excitation.recognise(np.tile(excitation.multisine(Lines.parse("20:140:20", 4000, 200)), 5), 4000)


def test_public_names_are_sorted_and_documented():
    assert excitation.__all__ == sorted(set(excitation.__all__), key=lambda n: (not n[0].isupper(), n))
    assert all(getattr(excitation, name).__doc__ for name in excitation.__all__ if name not in ("Phases", "Sweep"))


def test_what_was_recognised_is_immutable():
    with pytest.raises(dataclasses.FrozenInstanceError):
        FOUND.start = 3


def test_window_is_the_period_and_shapes_agree():
    assert FOUND.period == FOUND.lines.window == 200
    assert FOUND.amplitude.shape == (len(FOUND.lines),)
    assert FOUND.snr_db is None
    assert FOUND.steady == tuple(range(FOUND.periods))
    assert FOUND.stop - FOUND.start >= FOUND.periods * FOUND.period


def test_the_same_recording_gives_the_same_excitation():
    x = np.tile(excitation.multisine(Lines.parse("20:140:20", 4000, 200)), 5)
    again = excitation.recognise(list(x), 4000.0, x)
    assert again.lines == FOUND.lines
    assert again.snr_db.shape == (7,)
