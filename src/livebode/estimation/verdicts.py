"""Verdicts on lines from the mean over periods: distortion, mains hum, sensor steps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Flags, Floats
from livebode.core import Lines, QuantityKind
from livebode.estimation.distortion import Distortion, reached
from livebode.estimation.estimators import Role
from livebode.estimation.mains import Neighbours, mains_of
from livebode.estimation.spectra import after
from livebode.estimation.tracker_settings import Settings
from livebode.kernel import (
    REASONS,
    PeriodSpectra,
    PeriodState,
    PeriodVerdicts,
    RepeatingPlan,
    RepeatingSettings,
    Tones,
    judge_periods,
)
from livebode.language import Message

Reason = tuple[Message, dict[str, float]]

KINDS = ("distorted", "hum", "steps")
HUM = KINDS.index("hum")
_JUDGED_PER_S = 10  # times at most; for short periods a verdict in each period is not needed


@dataclass(frozen=True, eq=False)
class Verdict:
    """What is known of the lines after a period.

    Attributes
    ----------
    distortion
        Of numerator/denominator, shape (lines,); NaN where it is not known.
    against
        Whether a line is invalid for each of the `KINDS`, shape (kinds, lines).
    """

    distortion: Floats
    against: Flags

    @classmethod
    def nothing(cls, lines: int) -> Verdict:
        """Before the first one, and where the machine moves."""
        return cls(np.full(lines, np.nan), np.zeros((REASONS, lines), dtype=np.bool_))


def reason(
    verdicts: PeriodVerdicts, period: int, kind: int, line: int, f: float, output: QuantityKind | None
) -> Reason:
    """Why the line with this number and frequency is invalid since a period: for a message, and its details."""
    if KINDS[kind] == "steps":
        counts = float(verdicts.steps[period, line])
        message = Message(
            "the output moves only {steps:.2g} steps of its sensor at {line_hz:g} Hz: increase the excitation",
            steps=counts,
            line_hz=f,
        )
        if output == "other":
            message = Message("{few}; if the output is a velocity, declare it in source.kinds", few=message)
        return message, {"steps": counts}
    numerator, denominator = verdicts.pair[period, :, line]
    share = float(verdicts.distortion[period + 1, line] / np.abs(numerator / denominator))
    message = Message(
        "distortion may be {percent:.0f}% of the response at {line_hz:g} Hz (friction, backlash or sensor steps; "
        "increase the excitation, or move the axis)",
        percent=100 * share,
        line_hz=f,
    )
    return message, {"share": share}


class Judge:
    """Judges the lines by the moments of whole periods.

    Attributes
    ----------
    bins
        The lines, and the bins beside them at which distortion is seen.
    signals
        Output, denominator and reference among the signals.
    difference
        |1 − z⁻¹| at the lines.
    after
        Factors of the spectra of `signals` at `bins`, shape (3, bins); None where all are 1.
    judged_every
        Periods from one verdict to the next.
    """

    def __init__(
        self,
        lines: Lines,
        signals: tuple[int, int, int],
        instrument: bool,
        hann: bool,
        differenced: Flags,
        advanced: NDArray[np.int64],
    ) -> None:
        self.mains = mains_of(lines)
        self.distortion = Distortion(lines) if reached(lines).size > 0 and not hann else None
        beside = self.distortion.bins if self.distortion else np.zeros(0, dtype=np.int64)
        self.bins = np.concatenate([np.asarray(lines.bins), beside])
        self.window, self.lines, self.signals, self.instrument = lines.window, len(lines), signals, instrument
        self.difference = np.abs(1 - 1 / lines.z)
        self.after = None
        if differenced.any() or advanced.any():
            self.after = np.ascontiguousarray(after(self.bins, lines.window, differenced, advanced)[list(signals)])
        self.judged_every = max(1, round(lines.rate_hz / lines.window / _JUDGED_PER_S))
        self._plan = self._plan_of(len(differenced))

    def _plan_of(self, signals: int) -> RepeatingPlan:
        mains, nowhere = self.mains, np.zeros(0, dtype=np.int64)
        beside = np.zeros((2, self.lines, 4), dtype=np.int64)
        bins: tuple[NDArray[np.int64], NDArray[np.int64], Floats] = nowhere, nowhere, np.zeros(0)
        groups = beside, np.zeros(beside.shape, dtype=np.bool_), np.zeros(self.lines)
        if self.distortion is not None:
            between, means = self.distortion.interpolation, self.distortion.groups
            bins = between.left, between.right, between.share
            groups = means.places, means.member, means.position
        return RepeatingPlan(
            RepeatingSettings(
                self.window,
                signals,
                self.signals,
                self.bins,
                self.after,
                self.instrument,
                self.difference,
                self.judged_every,
                mains.bins,
                mains.lines,
                (_tones(mains.free[0]), _tones(mains.free[1])),
                _tones(mains.excited),
                *bins,
                *groups,
            )
        )

    def process(self, state: PeriodState, periods: PeriodSpectra) -> tuple[PeriodVerdicts, float, float]:
        """The verdicts after each of some periods, and `largest` and `step` of the state after them."""
        return judge_periods(self._plan, state, periods)


def _tones(beside: Neighbours) -> Tones:
    return Tones(beside.tones, beside.beside, beside.usable, beside.known, beside.enough, beside.times)


def judge_of(settings: Settings) -> Judge:
    """The Judge for these settings; several trackers of the same lines have the same one."""
    method = settings.method
    names: tuple[Role, Role, Role] = "output", method.denominator, method.reference
    output, denominator, reference = map(settings.roles.index, names)
    instrument = method.reference == "excitation"
    differenced, advanced = settings.differenced_roles, settings.advanced_ticks
    return _judge(settings.lines, (output, denominator, reference), instrument, settings.hann, differenced, advanced)


@lru_cache(maxsize=64)
def _judge(
    lines: Lines,
    signals: tuple[int, int, int],
    instrument: bool,
    hann: bool,
    differenced: tuple[bool, ...],
    advanced: tuple[int, ...],
) -> Judge:
    return Judge(lines, signals, instrument, hann, np.array(differenced), np.array(advanced))
