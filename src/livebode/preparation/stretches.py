"""The stretches of a recording, and which of them a run takes."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from typing import Literal

import numpy as np

from livebode.excitation import Excitation
from livebode.preparation.outlying import bounded
from livebode.preparation.transients import EXAMINED_MIN

StretchKind = Literal["silence", "transient", "periodic", "outlying", "differing"]


@dataclass(frozen=True)
class Stretch:
    """Consecutive samples of one kind.

    Attributes
    ----------
    kind
        "silence" before or after the excitation; "transient", "outlying" and "periodic" periods; "differing" ones,
        behind which the machine does not return to the state before.
    first, stop
        Number of the first sample and of the sample after the last one, in the recording.
    periods
        Its first and last period, counted from the beginning of the excitation; None for silence.
    taken
        Whether a run uses it by default.
    """

    kind: StretchKind
    first: int
    stop: int
    periods: tuple[int, int] | None
    taken: bool


def stretches(found: Excitation, first: int, samples: int) -> list[Stretch]:
    """Stretches of a recording whose searched part has this first sample and length, in samples, in their order."""
    judged = found.periods >= EXAMINED_MIN
    left_out = bounded(np.isin(np.arange(found.periods), found.outlying), last=True)

    def kind(m: int) -> StretchKind:
        if m in found.transient:
            return "transient"
        if m in found.outlying:
            return "outlying" if left_out[m] else "differing"
        return "periodic"

    start, period = first + found.start, found.period
    parts = [Stretch("silence", first, start, None, False)] if found.start else []
    for name, group in groupby(range(found.periods), kind):
        numbers = list(group)
        last = numbers[-1] + 1
        # The rest of the recording, shorter than a period, belongs to the last one.
        stop = first + found.stop if last == found.periods else start + last * period
        taken = name in ("periodic", "differing") or not judged
        parts.append(Stretch(name, start + numbers[0] * period, stop, (numbers[0], last - 1), taken))
    if found.stop < samples:
        parts.append(Stretch("silence", first + found.stop, first + samples, None, False))
    return parts
