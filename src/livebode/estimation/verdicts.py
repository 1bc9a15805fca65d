"""Verdicts on lines from the mean over periods: distortion, mains hum, sensor steps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from livebode.core import Lines, QuantityKind
from livebode.estimation.distortion import Distortion, reached
from livebode.estimation.mains import mains_of
from livebode.estimation.moments import Moments
from livebode.estimation.products import times
from livebode.estimation.settings import Settings
from livebode.estimation.spectra import after

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]
Reason = tuple[str, dict[str, float]]

KINDS = ("distorted", "hum", "steps")
HUM = KINDS.index("hum")
_DISTORTED = 0.5  # of |G|: from where on the value is not that of a linear machine
_STEPS = 0.5  # amplitude in steps of the sensor below which a line may not be seen at all


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
        return cls(np.full(lines, np.nan), np.zeros((len(KINDS), lines), dtype=np.bool_))


@dataclass(frozen=True, eq=False)
class Verdicts:
    """Several Verdicts, and what explains them: means of numerator and denominator, and amplitudes in sensor steps.

    Shapes: distortion and steps (rows, lines), against (rows, kinds, lines), pair (2, rows, lines).
    """

    distortion: Floats
    against: Flags
    pair: Complex
    steps: Floats

    def verdict(self, row: int) -> Verdict:
        return Verdict(self.distortion[row], self.against[row])

    def reason(self, row: int, kind: int, at: int, f: float, output: QuantityKind | None) -> Reason:
        """Why the line with this number and frequency is invalid: for a message, and its details."""
        if kind == HUM:
            return f"{f:g} Hz is a multiple of the mains frequency: mains hum detected; use other lines", {}
        if KINDS[kind] == "steps":
            counts = float(self.steps[row, at])
            message = f"the output moves only {counts:.2g} steps of its sensor at {f:g} Hz: increase the excitation"
            hint = "; if the output is a velocity, declare it in source.kinds" * (output == "other")
            return message + hint, {"steps": counts}
        numerator, denominator = self.pair[:, row, at]
        share = float(self.distortion[row, at] / np.abs(numerator / denominator))
        why = "friction, backlash or sensor steps; increase the excitation, or move the axis"
        return f"distortion may be {share:.0%} of the response at {f:g} Hz ({why})", {"share": share}


class Judge:
    """Judges the lines by the moments of whole periods.

    Attributes
    ----------
    bins
        The lines, and the bins beside them at which distortion is seen.
    lines, beside
        Their places in `bins`.
    """

    def __init__(self, lines: Lines, instrument: bool, hann: bool, differenced: Flags, advanced: NDArray[np.int64]):
        self.mains = mains_of(lines)
        self.distortion = Distortion(lines) if reached(lines).size > 0 and not hann else None
        beside = self.distortion.bins if self.distortion else np.zeros(0, dtype=np.int64)
        self.bins = np.concatenate([np.asarray(lines.bins), beside])
        self.lines, self.beside = slice(0, len(lines)), slice(len(lines), len(self.bins))
        self._window, self._instrument = lines.window, instrument
        self._difference = np.abs(1 - 1 / lines.z)
        self._plain = not (differenced.any() or advanced.any())
        self._after = after(self.bins, lines.window, differenced, advanced)[:, np.newaxis]

    def spectra(self, every: Complex) -> Complex:
        """The signals at `bins` from their DFT over whole periods, shape (signals, periods, bins)."""
        found = every[:, :, self.bins]
        return found if self._plain else times(found, self._after)

    def verdicts(
        self, moments: Moments, step: Floats, is_velocity: bool, output: Floats, silent: Flags, before: Verdict
    ) -> Verdicts:
        """One verdict for each row of the moments.

        Parameters
        ----------
        moments
            Of the output, the denominator and the reference at `bins`.
        step, is_velocity
            Step of the output's sensor, 0 without steps, (rows,); the steps of a velocity are those of the position
            that it was differenced from.
        output
            Power of the mean output at the bins of `mains`, shape (rows, bins).
        silent
            Lines with hum in periods without excitation.
        before
            The verdict before these.
        """
        pair = moments.pair
        numerator, denominator = pair[:, :, self.lines]
        steps = step[:, np.newaxis] * (self._difference if is_velocity else np.ones(len(silent)))
        of_steps = self._window * steps**2 / 12
        distortion, repeats = np.full(numerator.shape, np.nan), None
        if self.distortion is not None:
            repeats = self.distortion.repeats(moments, pair, self.lines, self.beside, self._instrument, of_steps)
            distortion = np.sqrt(repeats.variance) / np.abs(denominator)
        exceeds = distortion > _DISTORTED * np.abs(numerator / denominator)
        counts = 2 * np.abs(numerator) / self._window / steps
        # Noise larger than the steps carries any amplitude over them.
        quiet = moments.scatter[0, :, self.lines] / moments.weights.unbiased[:, np.newaxis] < of_steps
        coarse = (counts < _STEPS) & quiet
        against = np.stack([exceeds, silent | self.mains.seen(output), coarse], axis=1)
        for row in np.flatnonzero(exceeds.any(axis=1)).tolist():
            # A mean that was restarted has little significance; the previous verdict applies.
            if repeats is not None and not repeats.is_significant(row):
                against[row, 0] &= against[row - 1, 0] if row else before.against[0]
        return Verdicts(distortion, against, pair, counts)


def judge_of(settings: Settings) -> Judge:
    """The Judge for these settings; several trackers of the same lines have the same one."""
    instrument = settings.method.reference == "excitation"
    return _judge(settings.lines, instrument, settings.hann, settings.differenced_roles, settings.advanced_ticks)


@lru_cache(maxsize=64)
def _judge(
    lines: Lines, instrument: bool, hann: bool, differenced: tuple[bool, ...], advanced: tuple[int, ...]
) -> Judge:
    return Judge(lines, instrument, hann, np.array(differenced), np.array(advanced))
