"""Detection lines: bins without excitation, and the noise at the lines that is estimated from them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import GridError, Lines
from livebode.estimation.products import power, scaled, times
from livebode.estimation.tracker_settings import DETECTION_LINES_MIN

_BESIDE = 4  # detection lines on each side of a line, and at most as many beyond the outermost lines
_POWERLESS = 1e-4  # of the excitation's power at its lines: a bin with more counts as excited


def beyond(lines: Lines) -> tuple[int, ...]:
    """Bins below the first and above the last line, for the noise at these."""
    first, last = lines.bins[0], lines.bins[-1]
    above = range(last + 1, min(last + _BESIDE, (lines.window - 1) // 2) + 1)
    return (*range(max(1, first - _BESIDE), first), *above)


class Interpolation:
    """A frequency response at bins from that at the lines, shape (rows, lines) to (rows, bins).

    Between two lines linear in Ĝ where the phase rises (as at an antiresonance, whose numerator is smooth) and linear
    in 1/Ĝ where it falls (as at a resonance, whose denominator is); beyond the outermost lines as at these.
    """

    def __init__(self, lines: NDArray[np.int64], bins: NDArray[np.int64]) -> None:
        right = np.searchsorted(lines, bins).clip(0, len(lines) - 1)
        self.left, self.right = np.where(lines[right] > bins, np.maximum(right - 1, 0), right), right
        width = np.maximum(lines[self.right] - lines[self.left], 1)
        self.share = np.where(self.right > self.left, (bins - lines[self.left]) / width, 0.0)

    def at(self, ratio: Complex) -> Complex:
        left, right = ratio[..., self.left], ratio[..., self.right]
        falls = times(right, left.conj()).imag < 0
        straight = left + scaled(right - left, self.share)
        across = right + scaled(left - right, self.share)
        size = power(across)
        inverse = times(times(left, right), across.conj())
        return np.where(falls, scaled(inverse, 1 / size), straight)


class Groups:
    """Powers at lines from those at bins: the mean of up to four bins on each side, linear between the two means.

    Where one side has no bins, the other is used alone. Bins with power NaN are ignored.
    """

    def __init__(self, lines: NDArray[np.int64], bins: NDArray[np.int64]) -> None:
        above = np.searchsorted(bins, lines)[:, np.newaxis] + np.arange(_BESIDE)
        positions = np.stack([above - _BESIDE, above])  # (sides, lines, bins of a side)
        member = (positions >= 0) & (positions < len(bins))
        self.places, self.member = positions.clip(0, max(len(bins) - 1, 0)), member
        count = member.sum(axis=2)
        with np.errstate(invalid="ignore", divide="ignore"):
            centre = np.where(member, bins[self.places], 0).sum(axis=2) / count
            self.position = np.nan_to_num((lines - centre[0]) / (centre[1] - centre[0]))
        weight = np.stack([np.where(count[1] > 0, 1 - self.position, 1.0), np.where(count[0] > 0, self.position, 1.0)])
        self.dof = 1 / np.sum(weight**2 / np.where(count > 0, count, np.inf), axis=0)

    def at(self, powers: Floats) -> Floats:
        """Shape (rows, bins) to (rows, lines)."""
        beside = powers[:, self.places]  # (rows, sides, lines, bins of a side)
        known = self.member & np.isfinite(beside)
        with np.errstate(invalid="ignore", divide="ignore"):
            # One by one: the order of NumPy's own sums depends on how many rows there are.
            side = sum(np.moveaxis(np.where(known, beside, 0.0), 3, 0)) / known.sum(axis=3)
        below, above = side[:, 0], side[:, 1]
        between = below + (above - below) * self.position
        return np.asarray(np.where(np.isnan(below), above, np.where(np.isnan(above), below, between)))


class DetectionNoise:
    """|A_q − Ĝ_q·B_q|² at the detection lines (non-excited bins), interpolated over frequency to the lines.

    The residual at these bins is noise, distortion, and leakage from the axis's own motion.

    Parameters
    ----------
    lines
        The lines, and the bins between them that are not excited.
    outside
        Further bins that may be without excitation, below the first and above the last line.

    Raises
    ------
    GridError
        If there are too few such bins.
    """

    def __init__(self, lines: Lines, outside: tuple[int, ...] = ()) -> None:
        if len(lines.quiet) < DETECTION_LINES_MIN:
            raise GridError(
                "too-few-detection-lines",
                f"the lines leave {len(lines.quiet)} detection lines (bins without excitation), "
                f"but the noise needs {DETECTION_LINES_MIN}",
                "take the noise from the scatter between periods, or fewer lines",
                argument="noise",
                detection_lines=len(lines.quiet),
                detection_lines_min=DETECTION_LINES_MIN,
            )
        bins = np.asarray(lines.bins)
        self.bins = np.sort(np.array(lines.quiet + outside, dtype=np.int64))
        self._interpolation = Interpolation(bins, self.bins)
        self._groups = Groups(bins, self.bins)
        self.dof = float(self._groups.dof.min())

    def power(self, ratio: Complex, numerator: Complex, denominator: Complex, excited: Floats | None) -> Floats:
        """Noise power of the numerator at each line, shape (rows, lines).

        Parameters
        ----------
        ratio
            The estimate at the lines, (rows, lines).
        numerator, denominator
            Spectra at the detection lines, (rows, bins).
        excited
            Power of the excitation at the detection lines over that at the lines; excited bins are ignored.
        """
        residual = power(numerator - times(self._interpolation.at(ratio), denominator))
        if excited is not None:
            residual = np.where(excited > _POWERLESS, np.nan, residual)
        return self._groups.at(residual)
