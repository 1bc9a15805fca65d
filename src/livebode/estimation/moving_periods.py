"""Verdicts on distortion in the periods in which a machine moves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Floats
from livebode.core import Event, Stage, StatefulBase
from livebode.estimation.moving_distortion import MovingDistortion, PeriodAtBins
from livebode.estimation.periods import Periods
from livebode.estimation.products import times
from livebode.estimation.spectra import after
from livebode.estimation.tracker_settings import Role, Settings
from livebode.language import Message

_JUDGED_PER_S = 10  # times at most; of shorter periods the mean over some is judged


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
    _STATE = ("_distortion", "_sum", "_positions", "_periods", "_moved", "told")

    def __init__(
        self, settings: Settings, events: list[Event], *, enabled: bool = True, of_residual: bool = False
    ) -> None:
        lines, method = settings.lines, settings.method
        self._settings, self._events = settings, events
        self._distortion = MovingDistortion(lines, instrument=method.reference == "excitation")
        names: tuple[Role, Role, Role] = "output", method.denominator, method.reference
        roles = [settings.roles.index(name) for name in names]
        signals = [len(settings.roles) if of_residual else roles[0], *roles]
        at = self._distortion.at
        self.is_possible = enabled and at.size > 0 and settings.schedule is not None and not settings.hann
        self._places = np.ix_(np.array(signals), at)
        differenced, advanced = np.array(settings.differenced_roles), np.array(settings.advanced_ticks)
        self._after = after(at, lines.window, differenced, advanced)[[roles[0], *roles]]
        self._each = max(1, round(lines.rate_hz / lines.window / _JUDGED_PER_S))
        self._sum, self._positions = np.zeros((4, at.size), dtype=np.complex128), 0.0
        self._periods, self._moved = 0, False
        self.told = np.zeros(len(lines), dtype=np.bool_)
        self.begin()

    def begin(self) -> None:
        """Begin the verdicts with the present one."""
        self._rows: list[tuple[Floats, Flags, bool]] = [(self.distortion, self._distortion.invalid, self._moved)]

    def verdicts(self) -> MovingVerdicts:
        """The verdicts since `begin`."""
        distortion, invalid, moves = zip(*self._rows)
        return MovingVerdicts(np.stack(distortion), np.stack(invalid), np.array(moves))

    @property
    def distortion(self) -> Floats:
        """The newest verdict, shape (lines,); NaN where it is not known."""
        return self._distortion.distortion

    def end_stretch(self) -> None:
        """The next period does not follow the previous one."""
        self._distortion.end_stretch()
        self._sum[:], self._positions, self._periods = 0, 0.0, 0

    def process(self, spectra: Complex, periods: Periods, moves: Flags, clock: PeriodClock) -> None:
        """Add consecutive periods with their spectra, shape (signals, periods, bins)."""
        for number, moved in enumerate(moves.tolist()):
            self._moved = moved
            if not (self.is_possible and moved and periods.complete[number]):
                self.end_stretch()
            elif periods.schedule is not None:
                of_period = times(spectra[:, number][self._places], self._after)
                if self._add(of_period, float(periods.schedule[number].mean())):
                    self._report(clock, clock.last + number * self._settings.lines.window)
            self._rows.append((self.distortion, self._distortion.invalid, moved))

    def _add(self, spectra: Complex, position: float) -> bool:
        """Add a period; whether there is a new verdict."""
        self._sum += spectra
        self._positions += position
        self._periods += 1
        if self._periods < self._each:
            return False
        numerator, output, denominator, reference = self._sum / self._each
        mean = PeriodAtBins(numerator, output, denominator, reference, self._positions / self._each)
        self._sum[:], self._positions, self._periods = 0, 0.0, 0
        return self._distortion.process(mean)

    def _report(self, clock: PeriodClock, sample: int) -> None:
        lines, found = self._settings.lines, self._distortion
        speed = abs(found.speed) / (self._each * lines.window / lines.rate_hz)
        for line in np.flatnonzero(found.invalid & ~self.told).tolist():
            message, details = in_motion(float(lines.frequency_hz[line]), float(found.share[line]), speed, clock.unit)
            time_s = clock.origin_s + sample / lines.rate_hz
            self._events.append(Event("distorted", sample, time_s, message, details))
        self.told |= found.invalid


def in_motion(line_hz: float, share: float, speed: float, unit: str) -> tuple[Message, dict[str, float]]:
    """Why a line is invalid while the machine moves: for an Event, and its details."""
    message = Message(
        "distortion may be {percent:.0f}% of the response at {line_hz:g} Hz while the machine moves at {speed:.3g} "
        "{unit}/s (friction that reverses, or backlash: reduce the excitation, or move faster); the line is not valid",
        percent=100 * share,
        line_hz=line_hz,
        speed=speed,
        unit=unit or "units",
    )
    return message, {"line_hz": line_hz, "share": share, "speed": speed}
