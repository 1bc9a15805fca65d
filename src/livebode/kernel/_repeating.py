"""Verdicts on lines from whole periods of the signals, in C; `tests/twins/repeating.py` defines them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from livebode.arrays import Complex, Flags, Floats, Integers
from livebode.kernel import _native

Bytes = npt.NDArray[np.uint8]

REASONS = 3
"""Reasons against a line: distortion, mains hum, steps of the output's sensor."""
FORGOTTEN, ADDED, JUDGED, NEWS = 1, 2, 4, 8
"""What happened in a period, as bits: the mean was restarted; it was added to the mean; a verdict; lines with news."""
NEWS_INVALID, NEWS_GONE = 1, 2
"""News of a line: it became invalid; its hum has gone."""

RepeatingPlan = _native.RepeatingPlan
"""RepeatingSettings whose places were checked; several states have the same one. ValueError where one is refused."""


class Tones(NamedTuple):
    """Bins at which a tone may be, and the neighbours with which each is compared; places among the bins of the mains.

    Shapes (tones,), neighbours and usable (tones, neighbours): `known` is the number of usable ones, at least 1,
    `enough` whether they are enough, and `times` their mean that a tone exceeds.
    """

    tones: Integers
    neighbours: Integers
    usable: Flags
    known: Floats
    enough: Flags
    times: Floats


class RepeatingSettings(NamedTuple):
    """What all periods have in common.

    Attributes
    ----------
    window, signals
        N and the number of signals.
    of_signal
        Output, denominator and reference among these.
    bins
        The lines, and detection lines at which distortion is seen.
    after
        Factors of the spectra of `of_signal`, shape (3, bins); None without.
    instrument
        Whether the reference is the excitation itself.
    of_step
        What a step of the output's sensor is at a line, shape (lines,).
    judged_every
        Periods from one verdict to the next.
    mains_bins
        Bins whose power shows hum; none where no line is at a multiple of the mains.
    multiples
        Which lines are at a multiple of each mains frequency, shape (2, lines).
    free, excited
        Other multiples of each, and all lines.
    left, right, share
        Of each detection line the lines beside it, and its share of the way between them.
    beside, member, position
        Of each line the detection lines below and above, shape (2, lines, 4), whether there is one, and the line's
        share of the way between both, shape (lines,).
    """

    window: int
    signals: int
    of_signal: tuple[int, int, int]
    bins: Integers
    after: Complex | None
    instrument: bool
    of_step: Floats
    judged_every: int
    mains_bins: Integers
    multiples: Flags
    free: tuple[Tones, Tones]
    excited: Tones
    left: Integers
    right: Integers
    share: Floats
    beside: Integers
    member: Flags
    position: Floats


class PeriodState(NamedTuple):
    """What is known before some periods; the arrays change in place.

    Attributes
    ----------
    largest, step
        Largest power of the reference at a line, and step of the output's sensor.
    windows, means, scatter
        As those of `LineMoments`, of one place, at the lines and detection lines.
    output
        Mean spectrum of the output at the bins of the mains.
    silent_power, hum, low, counts
        Of periods without excitation: see `SilentHum`.
    told
        Lines that were reported for each reason, shape (reasons, lines).
    """

    largest: float
    step: float
    windows: Integers
    means: Floats
    scatter: Floats
    output: Complex
    silent_power: Floats
    hum: Floats
    low: Floats
    counts: Floats
    told: Flags


class PeriodSpectra(NamedTuple):
    """Consecutive periods.

    Attributes
    ----------
    spectra
        DFT of the signals, shape (signals, periods, N/2 + 1).
    usable, moves
        Without a missing sample; and in which the machine moves, shape (periods,).
    distortion, against
        The verdict before them, shapes (lines,) and (reasons, lines).
    step_of
        Step of the output in the period with this number.
    by_chance
        What the mean ratio of noise to itself exceeds by chance at so many detection lines with so many degrees of
        freedom.
    """

    spectra: Complex
    usable: Flags
    moves: Flags
    distortion: Floats
    against: Flags
    step_of: Callable[[int], float]
    by_chance: Callable[[int, float], float]


class PeriodVerdicts(NamedTuple):
    """The verdict before the periods, and after each.

    Attributes
    ----------
    distortion, against, invalid
        Shapes (periods + 1, lines), (periods + 1, reasons, lines) and (periods + 1, lines).
    happened
        Bits, shape (periods,).
    news
        Shape (periods, reasons, lines).
    pair, steps
        Where a period was judged: means of numerator and denominator, (periods, 2, lines), and amplitudes in steps of
        the sensor, (periods, lines).
    """

    distortion: Floats
    against: Flags
    invalid: Flags
    happened: Bytes
    news: Bytes
    pair: Complex
    steps: Floats

    @classmethod
    def empty(cls, periods: int, lines: int) -> PeriodVerdicts:
        """Room for those of so many periods."""
        return cls(
            np.empty((periods + 1, lines)),
            np.empty((periods + 1, REASONS, lines), np.bool_),
            np.empty((periods + 1, lines), np.bool_),
            np.empty(periods, np.uint8),
            np.empty((periods, REASONS, lines), np.uint8),
            np.empty((periods, 2, lines), np.complex128),
            np.empty((periods, lines)),
        )


def judge_periods(
    plan: RepeatingPlan, state: PeriodState, periods: PeriodSpectra
) -> tuple[PeriodVerdicts, float, float]:
    """The verdicts, and the new `largest` and `step` of the state."""
    verdicts = PeriodVerdicts.empty(len(periods.usable), len(periods.distortion))
    return verdicts, *_native.judge_periods(plan, state, periods, verdicts)
