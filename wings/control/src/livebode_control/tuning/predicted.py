"""The margins of a loop from its measured plant: as measured, and of the worst plant within the band."""

from __future__ import annotations

from dataclasses import replace
from math import inf, isfinite

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex, Floats
from livebode.dataclass import dataclass

_POINTS = 24  # on the edge of a disc


@dataclass(frozen=True)
class PredictedMargins:
    """Margins over all places; each the worst. Infinite where nothing limits it.

    Attributes
    ----------
    gain_margin_db, phase_margin_deg, max_sensitivity, disk_margin
        As in LoopSpecification.
    bandwidth_hz
        Where |T| first falls 3 dB below one.
    """

    gain_margin_db: float
    phase_margin_deg: float
    max_sensitivity: float
    disk_margin: float
    bandwidth_hz: float

    def with_unknown(self, largest: float) -> PredictedMargins:
        """Margins if |L| is up to `largest` with any phase at other frequencies."""
        size = min(largest, 1.0)
        return replace(
            self,
            gain_margin_db=min(self.gain_margin_db, float(-20 * np.log10(max(size, 1e-300)))),
            phase_margin_deg=self.phase_margin_deg if size < 1 else min(self.phase_margin_deg, 0.0),
            max_sensitivity=max(self.max_sensitivity, 1 / (1 - size) if size < 1 else inf),
            disk_margin=min(self.disk_margin, 2 * (1 - size) / (1 + size)),
        )

    @property
    def largest_unknown(self) -> float:
        """The |L| up to which `with_unknown` changes none of the margins."""
        return max(
            min(
                1 - 1 / self.max_sensitivity,
                float(10 ** (-self.gain_margin_db / 20)),
                (2 - self.disk_margin) / (2 + self.disk_margin),
            ),
            0.0,
        )

    def plain(self) -> dict[str, float | None]:
        """For JSON; infinite ones are null."""
        return {name: value if isfinite(value) else None for name, value in vars(self).items()}


def disk_margin(loop: ArrayLike) -> float:
    """α = 1/max |S − 1/2| = min 2·|1 + L|/|1 − L|, the balanced disk margin (skew 0) of a stable loop.

    Seiler, Packard and Gahinet, An introduction to disk margins, IEEE Control Systems 40(5), 2020.

    >>> round(disk_margin([-2j, -1j, -0.5]), 6)
    0.666667
    """
    values = np.asarray(loop, dtype=np.complex128)
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.nanmin(2 * np.abs(1 + values) / np.abs(1 - values)))


def predicted(frequency_hz: Floats, loop: Complex, radius: Floats) -> PredictedMargins:
    """Margins of L, shape (places, frequencies), for the worst point of the disc around each point."""
    values = loop.ravel()
    size = radius.ravel()
    edge = values[:, np.newaxis] + size[:, np.newaxis] * np.exp(2j * np.pi * np.arange(_POINTS) / _POINTS)
    nearest = np.abs(1 + values) - size
    sensitivity = float(np.max(1 / np.maximum(nearest, 1e-12)))
    closed = np.abs(loop / (1 + loop)) if not size.any() else _closed_least(loop, radius)
    return PredictedMargins(
        gain_margin_db=min(gain_margin_db(row, r) for row, r in zip(loop, radius)),
        phase_margin_deg=min(phase_margin_deg(row, r) for row, r in zip(loop, radius)),
        max_sensitivity=sensitivity,
        disk_margin=disk_margin(edge),
        bandwidth_hz=min(_bandwidth_hz(frequency_hz, row) for row in closed),
    )


def _closed_least(loop: Complex, radius: Floats) -> Floats:
    """The least |T| within each disc: 1/|T| = |1 + 1/L| is largest, and 1/L is in a disc, too."""
    inside = np.abs(loop) <= radius
    below = np.where(inside, 1.0, np.abs(loop) ** 2 - radius**2)
    most = np.abs(1 + np.conj(loop) / below) + radius / below
    return np.asarray(np.where(inside, 0.0, 1 / most))


def gain_margin_db(loop: Complex, radius: Floats) -> float:
    """From the point of the negative real axis nearest to −1, on the side of 0, that a disc or the curve reaches."""
    reach = radius**2 - loop.imag**2
    touching = (reach >= 0) & (loop.real < 0)
    left = loop.real[touching] - np.sqrt(reach[touching])
    first, second = loop[:-1], loop[1:]
    crossing = (first.imag * second.imag < 0) & (np.minimum(first.real, second.real) < 0)
    share = first.imag[crossing] / (first.imag[crossing] - second.imag[crossing])
    crossings = first.real[crossing] + share * (second.real[crossing] - first.real[crossing])
    crossings = crossings - (radius[:-1][crossing] * (1 - share) + radius[1:][crossing] * share)
    every = np.concatenate([left, crossings])
    nearer = every[(every > -1) & (every < 0)]
    return float(-20 * np.log10(-nearer.min())) if nearer.size else float("inf")


def phase_margin_deg(loop: Complex, radius: Floats) -> float:
    """From the points of the unit circle that a disc or the curve reaches."""
    size = np.abs(loop)
    reaching = (np.abs(size - 1) <= radius) & (size > 0)
    half = np.arccos(np.clip((1 + size[reaching] ** 2 - radius[reaching] ** 2) / (2 * size[reaching]), -1, 1))
    from_discs = np.abs(np.angle(-loop[reaching])) - half
    first, second = size[:-1] - 1, size[1:] - 1
    crossing = first * second < 0
    share = first[crossing] / (first[crossing] - second[crossing])
    crossings = loop[:-1][crossing] * (loop[1:] / loop[:-1])[crossing] ** share
    wide = np.arcsin(np.clip(radius[:-1][crossing] * (1 - share) + radius[1:][crossing] * share, 0, 1))
    every = np.concatenate([from_discs, np.abs(np.angle(-crossings)) - wide])
    return float(np.degrees(every.min())) if every.size else float("inf")


def _bandwidth_hz(frequency_hz: Floats, closed: Floats) -> float:
    """The first fall below −3 dB, interpolated in the logarithms."""
    level = 20 * np.log10(np.maximum(closed, 1e-300)) + 20 * np.log10(np.sqrt(2))
    below = np.flatnonzero(level < 0)
    if not below.size or below[0] == 0:
        return float(frequency_hz[0] if below.size else np.inf)
    i = int(below[0])
    share = level[i - 1] / (level[i - 1] - level[i])
    return float(frequency_hz[i - 1] * (frequency_hz[i] / frequency_hz[i - 1]) ** share)
