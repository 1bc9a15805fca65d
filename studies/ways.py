"""Ways to track |G| along a stroke: each gives responses within it, and the position that each is dated at."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from livebode import Block, Responses
from studies.common import WINDOW, Floats, Recording, correct, settings, track, within_stroke

Found = tuple[Responses, Floats]  # and the position that each is dated at
Way = Callable[[Recording], Found]


def newest_at_1_ms(recording: Recording) -> Found:
    """The paper's way: every fourth sample, N = 100, dated at the newest sample."""
    block = recording.block
    slow = Block(block.data[:, ::4], block.channels, block.rate_hz / 4)
    found = track(slow, WINDOW // 4, hop=5)
    shown = (found.first * 4 >= recording.first) & (found.sample * 4 <= recording.last)
    found = found[int(np.flatnonzero(shown)[0]) : int(np.flatnonzero(shown)[-1]) + 1]
    return found, slow["x"][found.sample]


def newest(recording: Recording) -> Found:
    found = within_stroke(track(recording.block), recording)
    return found, recording.block["x"][found.sample]


def centre(recording: Recording, **options: object) -> Found:
    found = within_stroke(track(recording.block, **options), recording)
    return found, found.schedule


def hann(recording: Recording) -> Found:
    return centre(recording, hann=True)


def by_model(recording: Recording, driven_by: str = "torque", **options: object) -> Found:
    """The stroke as one chunk: two masses that move as the axis did are fitted, and the error of motion is removed."""
    block = recording.block
    chosen = settings(block.rate_hz, loop=recording.axis.drive.loop(), **options)
    found = correct(recording.axis, block, len(block), chosen, driven_by=driven_by)
    found = within_stroke(found, recording)
    return found, found.schedule


def by_model_under_w(recording: Recording) -> Found:
    return by_model(recording, "excitation")
