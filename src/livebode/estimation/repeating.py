"""Errors that repeat with the excitation, so that no scatter shows them: distortion, mains hum, sensor steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block, Channel, Event, QuantityKind, Stage, StatefulBase
from livebode.core.steps import step_of
from livebode.estimation.bounds import power
from livebode.estimation.distortion import Distortion, reached
from livebode.estimation.levels import DistortionLevels
from livebode.estimation.mains import Mains
from livebode.estimation.moments import Moments, PeriodMoments
from livebode.estimation.movement import PLACES, Movement
from livebode.estimation.settings import Settings
from livebode.estimation.silence import SilentHum
from livebode.estimation.spectra import SpectraRows, after

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

_PERIODS_MIN = 2
_JUDGED_PER_S = 10  # times at most; for short periods a verdict in each period is not needed
_DISTORTED = 0.5  # of |G|: from where on the value is not that of a linear machine
_STEPS = 0.5  # amplitude in steps of the sensor below which a line may not be seen at all
_OTHER = 0.1  # of the excitation's power: from where on a period does not repeat the ones before
_EXCITED = 1e-12
_KINDS = ("distorted", "hum", "steps")
_HUM = _KINDS.index("hum")


@dataclass(frozen=True, eq=False)
class Repeating:
    """Verdict of the periods before each window: `distortion` of numerator/denominator and `invalid`, (rows, lines)."""

    distortion: Floats
    invalid: NDArray[np.bool_]
    dof: float


class RepeatingErrors(StatefulBase):
    """Detects in whole periods of the signals what repeats with the excitation but is not a linear response.

    One DFT a period, of the samples between the multiples of N. Periods with a sample that is left out, and periods in
    which the machine moves, do not count; a start, a gap, a pause or another phase of the excitation and a movement
    restart the mean over periods. A verdict applies from the next window on and is never averaged; after a gap or a
    pause the previous verdict applies until the next one.

    Parameters
    ----------
    settings
        Lines, signals and estimator.

    Attributes
    ----------
    levels
        Even and odd distortion.
    """

    _stage = Stage("repeating-errors", 2)
    _STATE = (
        "_samples", "_position", "_output", "_told", "_at", "_whole", "_largest", "_step", "_periods", "_moments",
        "_movement", "_silence", "levels",
    )  # fmt: skip

    def __init__(self, settings: Settings, events: list[Event] | None = None) -> None:
        self._settings, lines = settings, settings.lines
        self._mains = Mains(lines)
        possible = reached(lines).size > 0 and not settings.hann
        self._distortion = Distortion(lines) if possible else None
        beside = self._distortion.bins if self._distortion else np.zeros(0, dtype=np.int64)
        self._bins = np.concatenate([np.asarray(lines.bins), beside])
        self._lines, self._beside = slice(0, len(lines)), slice(len(lines), len(self._bins))
        differenced, advanced = np.array(settings.differenced_roles), np.array(settings.advanced_ticks)
        self._differenced, self._after = differenced, after(self._bins, lines.window, differenced, advanced)
        self._samples = np.zeros((len(settings.roles), lines.window + 1))  # with the one before the period
        self._position = np.full(lines.window, np.nan)
        self._at, self._whole, self._largest, self._step = 0, False, 0.0, 0.0
        self._looked = slice(0, None, -(-lines.window // PLACES))
        self._movement = Movement(self._position[self._looked].size)
        self.levels = DistortionLevels(settings)
        self._forget()
        self._now = np.full(len(lines), np.nan), np.zeros((len(_KINDS), len(lines)), dtype=np.bool_)
        self._silence = SilentHum(len(lines))
        self._judged_every = max(1, round(lines.rate_hz / lines.window / _JUDGED_PER_S))
        self._told = np.zeros((len(_KINDS), len(lines)), dtype=np.bool_)
        self._events = [] if events is None else events

    def _forget(self) -> None:
        self.levels.end_stretch()
        self._moments = PeriodMoments(1, len(self._bins), 1.0, own=True)
        self._output = np.zeros(self._mains.bins.size, dtype=np.complex128)
        self._periods = 0

    def _state(self) -> dict[str, Any]:
        return super()._state() | {"distortion": self._now[0], "invalid": self._now[1]}

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        self._now = state["distortion"], state["invalid"]

    def _converted(self, state: dict[str, Any], version: int) -> dict[str, Any]:
        """Version 1 has no levels."""
        return {"levels": DistortionLevels(self._settings).snapshot()} | state if version < 2 else state

    def judged(self) -> dict[str, Any]:
        """For a record: the lines with a reason against them, and the newest distortion at each."""
        f = self._settings.lines.frequency_hz
        reasons = {kind: f[self._told[i]].tolist() for i, kind in enumerate(_KINDS) if self._told[i].any()}
        known = None if self._distortion is None else [None if np.isnan(d) else float(d) for d in self._now[0]]
        return {
            "distortion": known,
            "invalid_lines_hz": reasons,
            "mains_lines_hz": f[self._mains.lines.any(axis=0)].tolist(),
        } | ({"levels": levels} if (levels := self.levels.plain()) else {})

    def finish(self, sample: int, time_s: float) -> None:
        """Report the levels of even and odd distortion, at the end of the samples."""
        if message := self.levels.sentence():
            self._events.append(Event("distortion-levels", sample, time_s, message))

    def restart(self, sample: int) -> None:
        """The next sample has this number and does not follow the previous one."""
        self._at = sample % self._settings.lines.window
        self._whole, self._position[:] = False, np.nan
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
        known, edges, done, window = [self._now], [0], 0, self._settings.lines.window
        while done < data.shape[1]:
            n = min(data.shape[1] - done, window - self._at)
            piece = slice(done, done + n)
            self._samples[:, self._at + 1 : self._at + 1 + n] = data[:, piece]
            self._position[self._at : self._at + n] = schedule[piece]
            self._whole &= not np.any((left_out >= done) & (left_out < done + n))
            self._at, done = self._at + n, done + n
            if self._at == window:
                self._end_period(block.start + done - 1, block)
                known.append(self._now)
                edges.append(done)
        which = np.searchsorted(edges, rows.sample - block.start, side="right") - 1
        distortion, invalid = np.array([d for d, _ in known]), np.array([i.any(axis=0) for _, i in known])
        dof = self._distortion.dof if self._distortion else np.inf
        return Repeating(distortion[which], invalid[which], dof)

    def _end_period(self, sample: int, block: Block) -> None:
        if self._movement.process(0, self._position[self._looked]).any():
            self._forget()
            self._now = np.full_like(self._now[0], np.nan), np.zeros_like(self._now[1])
        elif self._whole:
            with np.errstate(all="ignore"):
                gone = self._take(block.channels)
            self._report(sample, block.origin_s + sample / block.rate_hz, gone, self._kind(block.channels))
        self._samples[:, 0] = self._samples[:, -1]
        self._at, self._whole = 0, True

    def _take(self, channels: Sequence[Channel]) -> NDArray[np.bool_]:
        """Process a complete period; returns the lines whose hum has disappeared."""
        signals = self._samples[:, 1:]
        if self._differenced.any():
            signals = np.where(self._differenced[:, np.newaxis], np.diff(self._samples), signals)
        every = np.fft.rfft(signals)
        spectra = dict(zip(self._settings.roles, every[:, self._bins] * self._after))
        method = self._settings.method
        reference = spectra[method.reference]
        level = float(power(reference[self._lines]).max())
        self._largest = max(self._largest, level)
        output = every[0, self._mains.bins]
        if level <= _EXCITED * self._largest:
            return self._pause(power(output))
        self._silence.end()
        if method.reference == "excitation" and self._differs(reference[self._lines]):
            self._forget()
        three = np.stack([spectra["output"], spectra[method.denominator], reference])[:, np.newaxis]
        powers = np.stack([power(reference), power(spectra["output"]), *2 * [np.zeros(len(self._bins))]])
        moments = self._moments.update(0, three, powers[:, np.newaxis], np.zeros((3, 1)), np.array([True]))
        self.levels.take(every)
        self._periods += 1
        self._output += (output - self._output) / self._periods
        # Where the first period shows no step, few others do: the search takes as long as the rest of a period.
        if self._periods == 1 or (self._step == 0 and self._periods & (self._periods - 1) == 0):
            self._step = step_of(signals[0])
        late = self._periods - _PERIODS_MIN
        if late >= 0 and late % self._judged_every == 0:
            self._judge(moments, channels)
        return np.zeros(len(self._settings.lines), dtype=np.bool_)

    def _differs(self, excitation: Complex) -> bool:
        """Whether this period's excitation, at the lines, differs from the mean: it began or changed its phase."""
        mean = self._moments.now.reference[0, self._lines]
        return bool(self._periods and power(excitation - mean).sum() > _OTHER * power(mean).sum())

    def _pause(self, output: Floats) -> NDArray[np.bool_]:
        """A period without excitation, after which it may begin at another phase."""
        if self._periods:
            self._forget()
        gone = self._silence.take(*self._mains.alone(output))
        distortion, invalid = self._now
        invalid = invalid.copy()
        invalid[_HUM] &= ~gone
        self._now = distortion, invalid
        return gone

    def _judge(self, moments: Moments, channels: Sequence[Channel]) -> None:
        numerator, denominator = moments.pair[:, 0, self._lines]
        step, window = self._steps_at_lines(channels), self._settings.lines.window
        of_steps = window * step**2 / 12
        distortion, significant = np.full(len(numerator), np.nan), False
        if self._distortion is not None:
            instrument = self._settings.method.reference == "excitation"
            variance, significant = self._distortion.variance(moments, self._lines, self._beside, instrument, of_steps)
            distortion = np.sqrt(variance) / np.abs(denominator)
        hum = self._silence.lines | self._mains.seen(power(self._output))
        # A mean that was restarted has little significance; the previous verdict applies.
        distorted = (distortion > _DISTORTED * np.abs(numerator / denominator)) & (significant | self._now[1][0])
        self._counts = 2 * np.abs(numerator) / window / step
        # Noise larger than the steps carries any amplitude over them.
        quiet = moments.scatter[0, 0, self._lines] / moments.unbiased[0] < of_steps
        self._now = distortion, np.stack([distorted, hum, (self._counts < _STEPS) & quiet])

    def _steps_at_lines(self, channels: Sequence[Channel]) -> Floats:
        """The output's step at each line, in its unit; 0 without steps.

        The steps of a velocity are those of the position that it was differenced from.
        """
        lines = self._settings.lines
        velocity = self._kind(channels) in ("velocity", None)
        return self._step * (np.abs(1 - 1 / lines.z) if velocity else np.ones(len(lines)))

    def _kind(self, channels: Sequence[Channel]) -> QuantityKind | None:
        return next((c.stated_kind for c in channels if c.name == self._settings.output), None)

    def _report(self, sample: int, time_s: float, gone: NDArray[np.bool_], output: QuantityKind | None) -> None:
        for at in np.flatnonzero(gone & self._told[_HUM]):
            self._told[_HUM, at] = False
            f = self._settings.lines.frequency_hz[at]
            message = f"mains hum at {f:g} Hz is no longer detected without excitation; the line is valid again"
            self._events.append(Event("hum-gone", sample, time_s, message, {"line_hz": float(f)}))
        invalid = self._now[1]
        for i, at in zip(*np.nonzero(invalid & ~self._told)):
            self._told[i, at] = True
            f = self._settings.lines.frequency_hz[at]
            message, value = self._reason(_KINDS[i], int(at), f, output)
            details = {"line_hz": float(f)} | value
            self._events.append(Event(_KINDS[i], sample, time_s, f"{message}; the line is not valid", details))

    def _reason(self, kind: str, at: int, f: float, output: QuantityKind | None) -> tuple[str, dict[str, float]]:
        if kind == "hum":
            return (
                f"{f:g} Hz is a multiple of the mains frequency: mains hum detected; use other lines",
                {},
            )
        if kind == "steps":
            counts = float(self._counts[at])
            message = f"the output moves only {counts:.2g} steps of its sensor at {f:g} Hz: increase the excitation"
            hint = "; if the output is a velocity, declare it in source.kinds" * (output == "other")
            return message + hint, {"steps": counts}
        numerator, denominator = self._moments.now.pair[:, 0, at]
        share = float(self._now[0][at] / np.abs(numerator / denominator))
        why = "friction, backlash or sensor steps; increase the excitation, or move the axis"
        return f"distortion may be {share:.0%} of the response at {f:g} Hz ({why})", {"share": share}
