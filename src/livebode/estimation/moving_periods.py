"""Verdicts on distortion in the periods in which a machine moves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Floats
from livebode.core import Event, Stage, StatefulBase
from livebode.estimation.moving_distortion import DistortionRows, MovingDistortion, PeriodsAtBins
from livebode.estimation.periods import Periods, judged_every
from livebode.estimation.products import times
from livebode.estimation.spectra import after
from livebode.estimation.tracker_settings import Settings
from livebode.language import Message


class MovingVerdicts(NamedTuple):
    """Verdicts before the first period of some samples, and after each that ends in them.

    Attributes
    ----------
    distortion, invalid
        As in `RepeatingVerdicts`, shape (verdicts, lines).
    moves
        Whether the machine moves in the period before, shape (verdicts,).
    """

    distortion: Floats
    invalid: Flags
    moves: Flags

    def at(self, which: NDArray[np.int64]) -> MovingVerdicts:
        """The verdicts with these numbers."""
        return MovingVerdicts(self.distortion[which], self.invalid[which], self.moves[which])


class PeriodClock(NamedTuple):
    """Number of the last sample of the first period, time of sample 0 in s, and the unit of the schedule."""

    last: int
    origin_s: float
    unit: str


class MovingPeriods(StatefulBase):
    """A MovingDistortion of the complete periods of a stream in which the machine moves; an Event for each line.

    Parameters
    ----------
    settings
        Lines, signals and estimator.
    events
        Receives an Event for each line that becomes invalid.
    enabled
        Whether there are verdicts at all.
    of_residual
        Whether the numerator is what a model leaves of the output: one more signal, after those of the roles.

    Attributes
    ----------
    is_possible
        Whether there can be verdicts.
    told
        Lines with an Event so far, shape (lines,).
    """

    _stage = Stage("moving-periods", 1)
    _STATE = ("_distortion", "_sum", "_position", "_periods", "_moved", "told")

    def __init__(
        self, settings: Settings, events: list[Event], *, enabled: bool = True, of_residual: bool = False
    ) -> None:
        lines = settings.lines
        self._settings, self._events = settings, events
        self._distortion = MovingDistortion(lines, instrument=settings.method.reference == "excitation")
        roles = settings.signals
        self._signals = np.array([len(settings.roles) if of_residual else roles[0], *roles])
        at = self._distortion.at
        self.is_possible = enabled and at.size > 0 and settings.schedule is not None and not settings.hann
        differenced, advanced = np.array(settings.differenced_roles), np.array(settings.advanced_ticks)
        self._after = after(at, lines.window, differenced, advanced)[[roles[0], *roles]][:, np.newaxis]
        self._each = judged_every(lines)
        self._sum, self._position = np.zeros((4, at.size), dtype=np.complex128), 0.0
        self._periods, self._moved = 0, False
        self.told = np.zeros(len(lines), dtype=np.bool_)
        self.begin()

    def begin(self) -> None:
        """Begin the verdicts with the present one."""
        now = self._distortion.now
        self._rows = [MovingVerdicts(now.distortion, now.invalid, np.array([self._moved]))]

    def verdicts(self) -> MovingVerdicts:
        """The verdicts since `begin`."""
        return MovingVerdicts._make(map(np.concatenate, zip(*self._rows)))

    @property
    def distortion(self) -> Floats:
        """The newest verdict, shape (lines,); NaN where it is not known."""
        return np.asarray(self._distortion.now.distortion[0])

    def end_stretch(self) -> None:
        """The next period does not follow the previous one."""
        self._distortion.end_stretch()
        self._sum[:], self._position, self._periods = 0, 0.0, 0

    def process(self, periods: Periods, moves: Flags, clock: PeriodClock) -> None:
        """Add consecutive periods."""
        now, which = self._distortion.now, np.zeros(len(moves), dtype=np.int64)
        usable = moves & periods.complete
        if not self.is_possible or periods.schedule is None or not usable.any():
            self.end_stretch()
        else:
            # An incomplete period, which is not used, may be infinite.
            at_bins = np.where(usable[:, np.newaxis], periods.spectra[self._signals][:, :, self._distortion.at], 0)
            of_periods = times(at_bins, self._after)
            groups, usable, last = self._grouped(of_periods, periods.schedule.mean(axis=1), usable)
            if last.size:
                rows = self._distortion.process(groups, usable)
                self._report(rows, clock, clock.last + last * self._settings.lines.window)
                now = DistortionRows.joined([now, rows])
                which = np.searchsorted(last, np.arange(len(moves)), side="right")
        self._moved = bool(moves[-1])
        self._rows.append(MovingVerdicts(now.distortion[which], now.invalid[which], moves))

    def _grouped(
        self, spectra: Complex, position: Floats, usable: Flags
    ) -> tuple[PeriodsAtBins, Flags, NDArray[np.int64]]:
        """Means over some usable periods each, and the number of the last one; the others interrupt them."""
        if self._each == 1:
            return PeriodsAtBins._make((*spectra, position)), usable, np.arange(len(usable))
        means, positions, last = [], [], []
        for number, is_usable in enumerate(usable.tolist()):
            if is_usable:
                self._sum += spectra[:, number]
                self._position += float(position[number])
                self._periods += 1
            if not is_usable or self._periods == self._each:
                means.append(self._sum / self._each)
                positions.append(self._position / self._each)
                last.append(number)
                self._sum[:], self._position, self._periods = 0, 0.0, 0
        groups = np.stack(means, axis=1) if means else spectra[:, :0]
        ends = np.array(last, dtype=np.int64)
        return PeriodsAtBins._make((*groups, np.array(positions))), usable[ends], ends

    def _report(self, rows: DistortionRows, clock: PeriodClock, sample: NDArray[np.int64]) -> None:
        lines, seconds = self._settings.lines, self._each * self._settings.lines.window / self._settings.lines.rate_hz
        for row, line in zip(*np.nonzero(rows.invalid & ~self.told)):
            if not self.told[line]:
                speed, share = abs(float(rows.speed[row])) / seconds, float(rows.share[row, line])
                message, details = in_motion(float(lines.frequency_hz[line]), share, speed, clock.unit)
                time_s = clock.origin_s + int(sample[row]) / lines.rate_hz
                self._events.append(Event("distorted", int(sample[row]), time_s, message, details))
                self.told[line] = True


def in_motion(line_hz: float, share: float, speed: float, unit: str) -> tuple[Message, dict[str, float]]:
    """Why a line is invalid while the machine moves: for an Event, and its details."""
    message = Message(
        "distortion may be {percent:.0f}% of the response at {line_hz:g} Hz while the machine moves at {speed:.3g} "
        "{unit}/s (friction that reverses: move faster or reduce the excitation; backlash: increase the excitation); "
        "the line is not valid",
        percent=100 * share,
        line_hz=line_hz,
        speed=speed,
        unit=unit or "units",
    )
    return message, {"line_hz": line_hz, "share": share, "speed": speed}
