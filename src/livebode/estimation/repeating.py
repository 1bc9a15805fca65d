"""Errors that repeat with the excitation, so that no scatter shows them: distortion, mains hum, sensor steps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block, Channel, Event, QuantityKind, Stage
from livebode.core.steps import step_of
from livebode.estimation.levels import DistortionLevels
from livebode.estimation.moments import Moments, PeriodMoments
from livebode.estimation.movement import PLACES, Movement
from livebode.estimation.periods import PeriodCutter, Periods
from livebode.estimation.products import power
from livebode.estimation.settings import Settings
from livebode.estimation.silence import SilentHum
from livebode.estimation.spectra import SpectraRows
from livebode.estimation.verdicts import HUM, KINDS, Verdict, Verdicts, judge_of

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]

_PERIODS_MIN = 2
_JUDGED_PER_S = 10  # times at most; for short periods a verdict in each period is not needed
_OTHER = 0.1  # of the excitation's power: from where on a period does not repeat the ones before
_EXCITED = 1e-12


@dataclass(frozen=True, eq=False)
class Repeating:
    """Verdict of the periods before each window: `distortion` of numerator/denominator and `invalid`, (rows, lines)."""

    distortion: Floats
    invalid: NDArray[np.bool_]
    dof: float


@dataclass(frozen=True, eq=False)
class _Spectra:
    """Periods with excitation or without: DFT of all signals, and those of the estimate at the judged bins."""

    every: Complex  # (signals, periods, N/2 + 1)
    three: Complex  # output, denominator and reference, (3, periods, bins)
    output: Floats  # (periods, N)
    period: NDArray[np.int64]  # their numbers, (periods,)
    sample: NDArray[np.int64]  # their last samples, (periods,)

    def __len__(self) -> int:
        return len(self.period)

    def __getitem__(self, rows: slice) -> _Spectra:
        return _Spectra(
            self.every[:, rows], self.three[:, rows], self.output[rows], self.period[rows], self.sample[rows]
        )


class RepeatingErrors(PeriodCutter):
    """Detects in whole periods of the signals what repeats with the excitation but is not a linear response.

    One DFT a period, of the samples between the multiples of N. Periods with a sample that is left out, and periods in
    which the machine moves, do not count; a start, a gap, a pause or another phase of the excitation and a movement
    restart the mean over periods. A verdict applies from the next window on and is never averaged; after a gap or a
    pause the previous verdict applies until the next one.

    The periods of a Block are computed together, with the same results as one by one.

    Parameters
    ----------
    settings
        Lines, signals and estimator.

    Attributes
    ----------
    levels
        Even and odd distortion.
    """

    _stage = Stage("repeating-errors", 2, converts_from=1)
    _STATE = (
        *PeriodCutter._STATE, "_output", "_told", "_largest", "_step", "_periods", "_moments",
        "_movement", "_silence", "levels",
    )  # fmt: skip

    def __init__(self, settings: Settings, events: list[Event] | None = None) -> None:
        lines, method = settings.lines, settings.method
        super().__init__(lines.window, np.array(settings.differenced_roles))
        self._settings, self._judge = settings, judge_of(settings)
        self._three = [settings.roles.index(role) for role in ("output", method.denominator, method.reference)]
        self._largest, self._step = 0.0, 0.0
        self._looked = slice(0, None, -(-lines.window // PLACES))
        self._movement = Movement(self._position[self._looked].size)
        self.levels = DistortionLevels(settings)
        self._forget()
        self._now = Verdict.nothing(len(lines))
        self._silence = SilentHum(len(lines))
        self._judged_every = max(1, round(lines.rate_hz / lines.window / _JUDGED_PER_S))
        self._told = np.zeros((len(KINDS), len(lines)), dtype=np.bool_)
        self._events = [] if events is None else events

    def _forget(self) -> None:
        self.levels.end_stretch()
        self._moments = PeriodMoments(1, len(self._judge.bins), 1.0)
        self._output = np.zeros(self._judge.mains.bins.size, dtype=np.complex128)
        self._periods = 0

    def _state(self) -> dict[str, Any]:
        return super()._state() | {"distortion": self._now.distortion, "invalid": self._now.against}

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        self._now = Verdict(state["distortion"], state["invalid"])

    def _converted(self, state: dict[str, Any], version: int) -> dict[str, Any]:
        """Version 1 has no levels."""
        return {"levels": DistortionLevels(self._settings).snapshot()} | state if version < 2 else state

    def judged(self) -> dict[str, Any]:
        """For a record: the lines with a reason against them, and the newest distortion at each."""
        f = self._settings.lines.frequency_hz
        reasons = {kind: f[self._told[i]].tolist() for i, kind in enumerate(KINDS) if self._told[i].any()}
        newest = [None if np.isnan(d) else float(d) for d in self._now.distortion]
        return {
            "distortion": None if self._judge.distortion is None else newest,
            "invalid_lines_hz": reasons,
            "mains_lines_hz": f[self._judge.mains.lines.any(axis=0)].tolist(),
        } | ({"levels": levels} if (levels := self.levels.plain()) else {})

    def finish(self, sample: int, time_s: float) -> None:
        """Report the levels of even and odd distortion, at the end of the samples."""
        if message := self.levels.sentence():
            self._events.append(Event("distortion-levels", sample, time_s, message))

    def restart(self, sample: int) -> None:
        """The next sample has this number and does not follow the previous one."""
        self._begin_at(sample)
        self._forget()
        self._silence.interrupt()

    def process(
        self,
        data: Floats,
        rows: SpectraRows,
        schedule: Floats,
        block: Block,
    ) -> Repeating:
        """The verdicts for the windows of these rows.

        Parameters
        ----------
        data
            Signals, shape (channels, samples), in the order of the settings' roles.
        rows
            The windows that end in these samples, and which samples are left out.
        schedule
            Shape (samples,).
        block
            The Block of the samples: their numbers, times and channels.
        """
        left_out = np.concatenate([rows.not_finite, rows.implausible, rows.spikes, rows.left_out])
        known, edges = [self._now], [0]
        with np.errstate(all="ignore"):
            for periods in self._cut(data, schedule, left_out):
                known += self._after_each(periods, block)
                edges += periods.stop.tolist()
        which = np.searchsorted(edges, rows.sample - block.start, side="right") - 1
        distortion = np.array([verdict.distortion for verdict in known])
        invalid = np.logical_or.reduce([verdict.against for verdict in known], axis=1)
        dof = self._judge.distortion.dof if self._judge.distortion else np.inf
        return Repeating(distortion[which], invalid[which], dof)

    def _after_each(self, periods: Periods, block: Block) -> list[Verdict]:
        """The verdict after each of these periods."""
        looked = periods.schedule[:, self._looked]
        moves = np.logical_or.reduce(self._movement.process(0, looked.ravel()).reshape(looked.shape), axis=1)
        spectra = self._spectra(periods, np.flatnonzero(periods.complete & ~moves), block.start)
        ends = moves.copy()
        ends[spectra.period[self._paused(spectra)]] = True
        begun, changed, begin = self._now, dict[int, Verdict](), 0
        for end in [*np.flatnonzero(ends).tolist(), len(ends)]:
            first, last = np.searchsorted(spectra.period, [begin, end]).tolist()
            changed.update(self._excited(spectra[first:last], block))
            if end < len(ends):
                if moves[end]:
                    self._forget()
                    self._now = Verdict.nothing(len(self._settings.lines))
                else:
                    self._pause(spectra[last : last + 1], block)
                changed[end] = self._now
            begin = end + 1
        return list(accumulate(range(len(ends)), lambda now, number: changed.get(number, now), initial=begun))[1:]

    def _spectra(self, periods: Periods, use: NDArray[np.int64], start: int) -> _Spectra:
        signals = periods.signals if use.size == len(periods.complete) else periods.signals[:, use]
        every = np.fft.rfft(signals)
        three = self._judge.spectra(every)[self._three]
        return _Spectra(every, three, signals[0], use, start + periods.stop[use] - 1)

    def _paused(self, spectra: _Spectra) -> Flags:
        """Which periods have no excitation."""
        level = power(spectra.three[2][:, self._judge.lines]).max(axis=1)
        largest = np.fmax.accumulate(np.concatenate([[self._largest], level]))
        self._largest = float(largest[-1])
        return np.asarray(level <= _EXCITED * largest[1:])

    def _pause(self, spectra: _Spectra, block: Block) -> None:
        """A period without excitation, after which it may begin at another phase."""
        if self._periods:
            self._forget()
        mains = self._judge.mains
        gone = self._silence.take(*mains.alone(power(spectra.every[0, 0, mains.bins])))
        against = self._now.against.copy()
        against[HUM] &= ~gone
        self._now = Verdict(self._now.distortion, against)
        sample = int(spectra.sample[0])
        for at in np.flatnonzero(gone & self._told[HUM]):
            self._told[HUM, at] = False
            f = self._settings.lines.frequency_hz[at]
            message = f"mains hum at {f:g} Hz is no longer detected without excitation; the line is valid again"
            self._events.append(Event("hum-gone", sample, _time_s(block, sample), message, {"line_hz": float(f)}))

    def _excited(self, spectra: _Spectra, block: Block) -> Iterator[tuple[int, Verdict]]:
        """Process periods with excitation that follow each other; the numbers and results of those with a verdict."""
        if len(spectra):
            self._silence.end()
        done, together = 0, len(spectra)
        while done < len(spectra):
            part = spectra[done : done + together]
            if moments := self._add(part):
                count = len(moments.weights.one)
                yield from self._verdicts(part[:count], moments, block)
                done, together = done + count, 2 * together
            else:  # another phase: compare the next ones with this one, of which there may be few
                self._forget()
                together = 1

    def _add(self, spectra: _Spectra) -> Moments | None:
        """Add the periods up to the first whose excitation is another, and return the Moments after each of them."""
        now = self._moments.copy()
        moments = _update(now, spectra)
        if self._settings.method.reference == "excitation" and (count := self._repeating(spectra, moments)) < len(
            spectra
        ):
            return _update(self._moments, spectra[:count]) if count else None
        self._moments = now
        return moments

    def _repeating(self, spectra: _Spectra, moments: Moments) -> int:
        """Number of the first periods whose excitation, at the lines, is that of the mean before it."""
        lines = self._judge.lines
        mean = np.concatenate([self._moments.now.reference, moments.reference[:-1]])[:, lines]
        apart = power(spectra.three[2][:, lines] - mean).sum(axis=1)
        other = apart > _OTHER * power(mean).sum(axis=1)
        if not self._periods:
            other[0] = False
        return int(other.argmax()) if other.any() else len(spectra)

    def _verdicts(self, spectra: _Spectra, moments: Moments, block: Block) -> Iterator[tuple[int, Verdict]]:
        before = self._periods
        step, output = self._steps(spectra.output), self._mean_output(spectra.every)
        if self.levels.bins.size:
            for row in range(len(spectra)):
                self.levels.take(spectra.every[:, row])
        self._periods += len(spectra)
        late = np.arange(before + 1, self._periods + 1) - _PERIODS_MIN
        rows = np.flatnonzero((late >= 0) & (late % self._judged_every == 0))
        if not rows.size:
            return
        kind = self._kind(block.channels)
        found = self._judge.verdicts(
            moments.rows(rows), step[rows], kind in ("velocity", None), output[rows], self._silence.lines, self._now
        )
        for row in np.flatnonzero((found.against & ~self._told).any(axis=(1, 2))).tolist():
            self._report(found, row, int(spectra.sample[rows[row]]), block, kind)
        self._now = found.verdict(-1)
        yield from zip(spectra.period[rows].tolist(), map(found.verdict, range(rows.size)))

    def _steps(self, output: Floats) -> Floats:
        """The output's step as it is known after each period, shape (periods,)."""
        found = np.empty(len(output))
        for row, count in enumerate(range(self._periods + 1, self._periods + len(output) + 1)):
            # Where the first period shows no step, few others do: the search takes as long as the rest of a period.
            if count == 1 or (self._step == 0 and count & (count - 1) == 0):
                self._step = step_of(output[row])
            found[row] = self._step
        return found

    def _mean_output(self, every: Complex) -> Floats:
        """Power of the mean output at the bins of the mains after each period, shape (periods, bins)."""
        output = every[0][:, self._judge.mains.bins]
        if output.shape[1]:
            for row in range(len(output)):
                self._output += (output[row] - self._output) / (self._periods + row + 1)
                output[row] = self._output
        return power(output)

    def _kind(self, channels: Sequence[Channel]) -> QuantityKind | None:
        return next((c.stated_kind for c in channels if c.name == self._settings.output), None)

    def _report(self, found: Verdicts, row: int, sample: int, block: Block, output: QuantityKind | None) -> None:
        for i, at in zip(*np.nonzero(found.against[row] & ~self._told)):
            self._told[i, at] = True
            f = self._settings.lines.frequency_hz[at]
            message, value = found.reason(row, int(i), int(at), f, output)
            message, details = f"{message}; the line is not valid", {"line_hz": float(f)} | value
            self._events.append(Event(KINDS[i], sample, _time_s(block, sample), message, details))


def _update(moments: PeriodMoments, spectra: _Spectra) -> Moments:
    output, _, reference = spectra.three
    powers = np.zeros((4, *output.shape))
    powers[:2] = power(reference), power(output)
    return moments.add(0, spectra.three, powers)


def _time_s(block: Block, sample: int) -> float:
    return block.origin_s + sample / block.rate_hz
