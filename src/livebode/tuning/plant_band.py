"""PlantBand: the plant at, between and beyond its lines, with the radius that contains it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from livebode.core import Responses, TuneError

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

_BETWEEN = 3  # points between neighbouring lines
_LOWEST = 1e-4  # of the lowest line
_PER_DECADE, _ABOVE = 6, 24
_LINES_MIN = 8
_NOISE = 0.5  # of the radius: half of the difference of two parabolas through noise is below 0.28 of it
_TO_95 = float(np.sqrt(np.log(20.0)))  # bound over sigma of circular normal noise
_BEYOND = np.pi / 2  # a sampled integrator at half the rate, compared with 1/f


@dataclass(frozen=True, eq=False)
class PlantBand:
    """The plant of each place on a grid of frequencies up to half the rate, with a radius that contains the truth.

    At the lines the value is the measured one; the radius covers all lines and places together with the confidence
    (Bonferroni: 1 − exp(−c²) = 1 − (1 − confidence)/(lines·places), widened for the degrees of freedom). Between two
    lines G, log G or 1/G is the cubic through the four next ones, the weighted mean of two parabolas, and half of the
    difference of these widens the radius. It is log G where the radius may explain its difference, since noise could
    make a pole of 1/G; else the one of the three whose parabolas differ least: near a resonance 1/G is almost a
    parabola, near an antiresonance G. Below the lowest line the plant continues as 1, 1/f or 1/f², whichever has the
    phase of the lowest line. Above the highest it is not known: only its size is limited, to π/2 times a fall as 1/f.

    Biased where a resonance lies between two lines without a trace at either of them.

    Attributes
    ----------
    frequency_hz
        Ascending, the last half the rate; shape (frequencies,).
    value, radius
        Shape (places, frequencies).
    measured
        Which frequencies are lines, shape (frequencies,).
    above
        Which frequencies are above the highest line.
    spread
        Share of |G| by which interpolation widens the radius, shape (places, frequencies).
    coarseness
        Half of the difference of both parabolas of log G: above 0.5 the lines do not resolve a resonance; shape
        (places, frequencies).
    sigma
        Standard deviation, so large that 95 % of normal noise are within the 95 % bound of few degrees of freedom;
        shape (places, frequencies).
    lines_hz, dropped_hz
        The used lines, and those that were measured but are not valid or have too little coherence.
    """

    frequency_hz: Floats
    value: Complex
    radius: Floats
    measured: NDArray[np.bool_]
    above: NDArray[np.bool_]
    spread: Floats
    coarseness: Floats
    sigma: Floats
    lines_hz: Floats
    dropped_hz: Floats

    @classmethod
    def of(cls, responses: Responses, rate_hz: float, *, coherence: float = 0.5, confidence: float = 0.95) -> PlantBand:
        """The band of responses, a row for each place.

        Raises
        ------
        TuneError
            If fewer than eight lines are valid at every place with the coherence.
        """
        known = np.nan_to_num(responses.coherence, nan=1.0) >= coherence
        use = np.all(responses.valid & known & np.isfinite(responses.sigma), axis=0)
        lines = responses.lines.frequency_hz[use]
        if lines.size < _LINES_MIN:
            raise TuneError(
                "coherence-low",
                f"{lines.size} of {use.size} lines are valid with a coherence of {coherence:g} or more; "
                f"{_LINES_MIN} are needed",
                "excite with more amplitude, or measure longer",
                lines=int(lines.size),
                dropped_hz=responses.lines.frequency_hz[~use].tolist(),
            )
        value = responses.value[:, use]
        sigma = responses.bound(_TO_95)[:, use] / _TO_95
        c = float(np.sqrt(np.log(value.size / (1 - confidence))))
        radius = responses.bound(c)[:, use]
        dropped = responses.lines.frequency_hz[~use]
        return replace(cls.at_lines(lines, value, radius, sigma, rate_hz), dropped_hz=dropped)

    def only(self, columns: NDArray[np.bool_]) -> PlantBand:
        """The same at some of the frequencies."""
        named = ("frequency_hz", "value", "radius", "measured", "above", "spread", "coarseness", "sigma")
        return replace(self, **{name: getattr(self, name)[..., columns] for name in named})

    def at(self, places: Sequence[int]) -> PlantBand:
        """The same at some of the places."""
        named = ("value", "radius", "spread", "coarseness", "sigma")
        return replace(self, **{name: getattr(self, name)[places] for name in named})

    @classmethod
    def at_lines(cls, lines_hz: Floats, value: Complex, radius: Floats, sigma: Floats, rate_hz: float) -> PlantBand:
        """The same from a radius at each line; shapes (lines,) and (places, lines)."""
        inside, share, left = _refined(lines_hz)
        middle, gap, coarse = _between(lines_hz, value, radius, inside, left)
        mixed = (1 - share) * radius[:, left] + share * radius[:, left + 1]
        deviation = (1 - share) * sigma[:, left] + share * sigma[:, left + 1]
        low = np.geomspace(_LOWEST * lines_hz[0], lines_hz[0], int(-np.log10(_LOWEST) * _PER_DECADE), endpoint=False)
        high = np.geomspace(lines_hz[-1], rate_hz / 2, _ABOVE + 1)[1:]
        parts = [low, inside, high]
        n = len(value)

        def joined(below: Floats | Complex, within: Floats | Complex, beyond: Floats | Complex) -> NDArray[np.generic]:
            return np.concatenate([np.broadcast_to(x, (n, p.size)) for x, p in zip((below, within, beyond), parts)], 1)

        order = np.clip(np.rint(-np.angle(value[:, :1]) / (np.pi / 2)), 0, 2)
        rise = (lines_hz[0] / low) ** order
        size = (np.abs(value) + radius)[:, -2:].max(axis=1, keepdims=True)
        limit = _BEYOND * size * lines_hz[-1] / high
        interpolation = np.abs(middle) * gap
        zero = np.zeros(1)
        count = [p.size for p in parts]
        return cls(
            frequency_hz=np.concatenate(parts),
            value=joined(value[:, :1] * rise, middle, -1j * limit).astype(np.complex128),
            radius=joined(radius[:, :1] * rise, mixed + interpolation, zero).astype(np.float64),
            measured=np.concatenate([np.zeros(count[0], bool), np.isin(inside, lines_hz), np.zeros(count[2], bool)]),
            above=np.repeat([False, False, True], count),
            spread=joined(zero, gap, zero).astype(np.float64),
            coarseness=joined(zero, coarse, zero).astype(np.float64),
            sigma=joined(sigma[:, :1] * rise, deviation, zero).astype(np.float64),
            lines_hz=lines_hz,
            dropped_hz=np.empty(0),
        )


def _refined(lines_hz: Floats) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Frequencies of the lines and between them, the share of the way to the next line, and the line before."""
    share = np.arange(_BETWEEN + 1) / (_BETWEEN + 1)
    left = np.repeat(np.arange(lines_hz.size - 1), _BETWEEN + 1)
    part = np.tile(share, lines_hz.size - 1)
    left, part = np.append(left, lines_hz.size - 2), np.append(part, 1.0)
    at = lines_hz[left] * (1 - part) + lines_hz[left + 1] * part
    at[part == 0], at[-1] = lines_hz[:-1], lines_hz[-1]
    return at, part, left


def _between(
    lines_hz: Floats, value: Complex, radius: Floats, at: Floats, left: NDArray[np.int64]
) -> tuple[Complex, Floats, Floats]:
    """G at the frequencies, half the difference of its parabolas as a share of |G|, and that of log G.

    Shape (places, frequencies).
    """
    log = np.log(np.abs(value)) + 1j * np.unwrap(np.angle(value), axis=1)
    share = _share(lines_hz, at, left)
    parabolas = [_parabolas(lines_hz, transformed, at, left) for transformed in (log, value, 1 / value)]
    backs: list[Callable[[Complex], Complex]] = [np.exp, np.asarray, np.reciprocal]
    middles, gaps = [], []
    for (before, after), back in zip(parabolas, backs):
        with np.errstate(all="ignore"):  # a cubic of 1/G may pass 0
            middle = back((1 - share) * before + share * after)
            gap = np.abs(back(before) - back(after)) / np.abs(middle) / 2
        middles.append(middle)
        gaps.append(_to_ends(np.where(np.isfinite(gap), gap, np.inf)))
    starts = np.flatnonzero(np.diff(left, prepend=-1))
    least = np.argmin(np.add.reduceat(gaps, starts, axis=2), axis=0)[:, left]
    before, after = parabolas[0]
    coarse = _to_ends(np.abs(before - after) / 2)
    noise = radius / np.abs(value)
    noisy = np.maximum.reduceat(coarse, starts, axis=1) <= _NOISE * np.maximum(noise[:, :-1], noise[:, 1:])
    least = np.where(noisy[:, left], 0, least)
    middle, gap = (np.take_along_axis(np.array(of), least[np.newaxis], 0)[0] for of in (middles, gaps))
    on_line = np.isin(at, lines_hz)
    gap[:, on_line] = coarse[:, on_line] = 0.0
    return middle, gap, coarse


def cubic(lines_hz: Floats, values: Complex, at: Floats) -> Complex:
    """Values of the lines, shape (rows, lines), between them by the cubic through four; beyond them constant."""
    within = np.clip(at, lines_hz[0], lines_hz[-1])
    left = np.clip(np.searchsorted(lines_hz, within, side="right") - 1, 0, lines_hz.size - 2)
    share = _share(lines_hz, within, left)
    before, after = _parabolas(lines_hz, values, within, left)
    return np.asarray((1 - share) * before + share * after)


def _share(lines_hz: Floats, at: Floats, left: NDArray[np.int64]) -> Floats:
    """Of the way from the line before to the next one."""
    return np.asarray((at - lines_hz[left]) / (lines_hz[left + 1] - lines_hz[left]))


def _to_ends(gap: Floats) -> Floats:
    """At the ends only one parabola exists; the neighbouring gap stands for the missing difference."""
    width = _BETWEEN + 1
    gap[:, :width] = np.maximum(gap[:, :width], gap[:, width : 2 * width])
    gap[:, -width - 1 :] = np.maximum(gap[:, -width - 1 :], gap[:, -2 * width - 1 : -width])
    return gap


def _parabolas(lines_hz: Floats, values: Complex, at: Floats, left: NDArray[np.int64]) -> tuple[Complex, Complex]:
    """Through the line before each gap, and through the line after it."""
    before, after = (_parabola(lines_hz, values, at, np.clip(left - i, 0, lines_hz.size - 3)) for i in (1, 0))
    return before, after


def _parabola(lines_hz: Floats, values: Complex, at: Floats, first: NDArray[np.int64]) -> Complex:
    """Through three lines from `first` on (Lagrange)."""
    x = [lines_hz[first + i] for i in range(3)]
    total = np.zeros((len(values), at.size), dtype=np.complex128)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        total += values[:, first + i] * ((at - x[j]) * (at - x[k]) / ((x[i] - x[j]) * (x[i] - x[k])))
    return total
