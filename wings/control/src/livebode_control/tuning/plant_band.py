"""PlantBand: the plant at, between and beyond its lines, with the radius that contains it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import CIRCLE_FACTOR, Responses, TuneError
from livebode.dataclass import dataclass
from livebode_control.tuning.modal_fit import ModalFit

_BETWEEN = 3  # points between neighbouring lines, or more
_STEP = 0.02  # of the frequency: with a larger one, L between two points may come 1 % nearer to −1 than at both
_BETWEEN_NARROW = 12  # parts of the distance of lines, within two octaves of a mode that is narrower
_LOWEST = 1e-4  # of the lowest line
_PER_DECADE, _ABOVE = 6, 24
_NEXT = 1.0001  # of the highest line: the first frequency above it
_LINES_MIN = 8
_WIDTHS = np.tan(np.radians(np.arange(-80, 81, 10)))  # half-widths from a narrow mode: 20° of its circle each
_FITTED = 2.5  # sigma of a fitted response
_NOISE = 0.5  # of the radius: half of the difference of two parabolas through noise is below 0.28 of it


@dataclass(frozen=True, eq=False)
class PlantBand:
    """The plant of each place on a grid of frequencies up to half the rate, with a radius that contains the truth.

    At the lines the value is the measured one; the radius covers all lines and places together with the confidence
    (Bonferroni: 1 − exp(−c²) = 1 − (1 − confidence)/(lines·places), widened for the degrees of freedom). Between two
    lines, at points 2 % of the frequency apart or less, G, log G or 1/G is the cubic through the four next ones, the
    weighted mean of two parabolas, and half of the difference of these widens the radius. It is log G where the radius
    may explain its difference, since noise could make a pole of 1/G; else the one of the three whose parabolas differ
    least: near a resonance 1/G is almost a parabola, near an antiresonance G. Near a mode that is narrower than the
    distance of lines it is the ratio of G to the fitted modes (`ModalFit`), whose bound widens the radius, too. Below
    the lowest line the plant continues as 1, 1/f or 1/f², whichever has the phase of the lowest line. Above the highest
    it is not known: the value is the fall that the fitted modes predict, of unknown phase, and its size is limited to
    that times `rise`.

    Biased where a resonance between two lines is without a trace at either of them, and above the highest line where a
    damping ratio is below 0.003.

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
    rise
        Above it, the factor by which a mode that the lines permit exceeds the fall that they predict; else 1; shape
        (places, frequencies).
    shown_hz
        The lowest mode above the highest line that the lines show, NaN without one; shape (places,).
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
    rise: Floats
    shown_hz: Floats
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
        sigma = responses.bound()[:, use] / CIRCLE_FACTOR
        c = float(np.sqrt(np.log(value.size / (1 - confidence))))
        radius = responses.bound(c)[:, use]
        dropped = responses.lines.frequency_hz[~use]
        return replace(cls.at_lines(lines, value, radius, sigma, rate_hz), dropped_hz=dropped)

    @property
    def lowest_shown_hz(self) -> float | None:
        """The lowest mode above the highest line that the lines show at any place; None without one."""
        shown = self.shown_hz[np.isfinite(self.shown_hz)]
        return float(shown.min()) if shown.size else None

    def without_modes_above(self) -> PlantBand:
        """This plant if it fell above the lines as they predict."""
        return replace(self, rise=np.ones_like(self.rise))

    def only(self, columns: NDArray[np.bool_]) -> PlantBand:
        """This plant at some of its frequencies."""
        named = ("frequency_hz", "value", "radius", "measured", "above", "rise", "spread", "coarseness", "sigma")
        return replace(self, **{name: getattr(self, name)[..., columns] for name in named})

    def at(self, places: Sequence[int]) -> PlantBand:
        """This plant at some of its places."""
        named = ("value", "radius", "rise", "shown_hz", "spread", "coarseness", "sigma")
        return replace(self, **{name: getattr(self, name)[places] for name in named})

    @classmethod
    def at_lines(cls, lines_hz: Floats, value: Complex, radius: Floats, sigma: Floats, rate_hz: float) -> PlantBand:
        """The plant between its lines and above, from a radius at each line; shapes (lines,) and (places, lines)."""
        modes = [ModalFit.of(lines_hz, row, noise, rate_hz) for row, noise in zip(value, sigma)]
        inside, share, left = _refined(lines_hz, np.concatenate([mode.narrow(lines_hz) for mode in modes]))
        middle, gap, coarse = _between(lines_hz, value, radius, inside, left)
        mixed = (1 - share) * radius[:, left] + share * radius[:, left + 1]
        deviation = (1 - share) * sigma[:, left] + share * sigma[:, left + 1]
        for row, fit in enumerate(modes):
            between = _near(fit.narrow(lines_hz), inside) & ~np.isin(inside, lines_hz)
            if between.any():
                model = _by_model(fit, lines_hz, value[row], inside[between], left[between])
                scale = np.abs(model[0] / middle[row, between])
                mixed[row, between] *= scale
                deviation[row, between] *= scale
                middle[row, between], gap[row, between], coarse[row, between] = model
        low = np.geomspace(_LOWEST * lines_hz[0], lines_hz[0], int(-np.log10(_LOWEST) * _PER_DECADE), endpoint=False)
        high = np.geomspace(_NEXT * lines_hz[-1], rate_hz / 2, _ABOVE)
        parts = [low, inside, high]
        n = len(value)

        def joined(below: Floats | Complex, within: Floats | Complex, beyond: Floats | Complex) -> NDArray[np.generic]:
            return np.concatenate([np.broadcast_to(x, (n, p.size)) for x, p in zip((below, within, beyond), parts)], 1)

        order = np.clip(np.rint(-np.angle(value[:, :1]) / (np.pi / 2)), 0, 2)
        below = (lines_hz[0] / low) ** order
        fall, rise = (np.stack(part) for part in zip(*(mode.above(high) for mode in modes)))
        interpolation = np.abs(middle) * gap
        zero = np.zeros(1)
        count = [p.size for p in parts]
        return cls(
            frequency_hz=np.concatenate(parts),
            value=joined(value[:, :1] * below, middle, -1j * fall).astype(np.complex128),
            radius=joined(radius[:, :1] * below, mixed + interpolation, zero).astype(np.float64),
            measured=np.concatenate([np.zeros(count[0], bool), np.isin(inside, lines_hz), np.zeros(count[2], bool)]),
            above=np.repeat([False, False, True], count),
            rise=joined(np.ones(1), np.ones(1), rise).astype(np.float64),
            shown_hz=np.array([mode.shown_hz for mode in modes]),
            spread=joined(zero, gap, zero).astype(np.float64),
            coarseness=joined(zero, coarse, zero).astype(np.float64),
            sigma=joined(sigma[:, :1] * below, deviation, zero).astype(np.float64),
            lines_hz=lines_hz,
            dropped_hz=np.empty(0),
        )


def _refined(lines_hz: Floats, narrow: Floats) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Frequencies of the lines, between them and around narrow modes, their share of the way between two lines, and
    the line before."""
    parts = np.maximum(np.ceil(np.diff(lines_hz) / (_STEP * lines_hz[:-1])), _BETWEEN + 1).astype(int)
    between = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(lines_hz, lines_hz[1:], parts)]
    finer = np.arange(1, _BETWEEN_NARROW) / _BETWEEN_NARROW
    near = _near(narrow, lines_hz[:-1])
    dense = lines_hz[:-1][near, np.newaxis] + np.diff(lines_hz)[near, np.newaxis] * finer
    around = np.append((narrow[:, :1] + narrow[:, 1:] * _WIDTHS).ravel(), dense)
    grid_hz = np.unique(np.concatenate([lines_hz, *between, around.ravel()]))
    grid_hz = grid_hz[(grid_hz >= lines_hz[0]) & (grid_hz <= lines_hz[-1])]
    left = np.clip(np.searchsorted(lines_hz, grid_hz, side="right") - 1, 0, lines_hz.size - 2)
    return grid_hz, _share(lines_hz, grid_hz, left), left


def _between(
    lines_hz: Floats, value: Complex, radius: Floats, f: Floats, left: NDArray[np.int64]
) -> tuple[Complex, Floats, Floats]:
    """G at the frequencies, half the difference of its parabolas as a share of |G|, and that of log G.

    Shape (places, frequencies).
    """
    log = np.log(np.abs(value)) + 1j * np.unwrap(np.angle(value), axis=1)
    share = _share(lines_hz, f, left)
    parabolas = [_parabolas(lines_hz, transformed, f, left) for transformed in (log, value, 1 / value)]
    backs: list[Callable[[Complex], Complex]] = [np.exp, np.asarray, np.reciprocal]
    middles, gaps = [], []
    for (before, after), back in zip(parabolas, backs):
        with np.errstate(all="ignore"):  # a cubic of 1/G may pass 0
            middle = back((1 - share) * before + share * after)
            gap = np.abs(back(before) - back(after)) / np.abs(middle) / 2
        middles.append(middle)
        gaps.append(_to_ends(np.where(np.isfinite(gap), gap, np.inf), share, left))
    starts = np.flatnonzero(np.diff(left, prepend=-1))
    least = np.argmin(np.add.reduceat(gaps, starts, axis=2), axis=0)[:, left]
    before, after = parabolas[0]
    coarse = _to_ends(np.abs(before - after) / 2, share, left)
    noise = radius / np.abs(value)
    noisy = np.maximum.reduceat(coarse, starts, axis=1) <= _NOISE * np.maximum(noise[:, :-1], noise[:, 1:])
    least = np.where(noisy[:, left], 0, least)
    middle, gap = (np.take_along_axis(np.array(of), least[np.newaxis], 0)[0] for of in (middles, gaps))
    on_line = np.isin(f, lines_hz)
    gap[:, on_line] = coarse[:, on_line] = 0.0
    return middle, gap, coarse


def cubic(lines_hz: Floats, values: Complex, f: Floats) -> Complex:
    """Values of the lines, shape (rows, lines), between them by the cubic through four; beyond them constant."""
    within = np.clip(f, lines_hz[0], lines_hz[-1])
    left = np.clip(np.searchsorted(lines_hz, within, side="right") - 1, 0, lines_hz.size - 2)
    share = _share(lines_hz, within, left)
    before, after = _parabolas(lines_hz, values, within, left)
    return np.asarray((1 - share) * before + share * after)


def _near(narrow: Floats, f: Floats) -> NDArray[np.bool_]:
    """Which points are within two octaves of a narrow mode, as is its antiresonance up to an inertia ratio of 15."""
    return np.asarray((np.abs(np.log2(f[:, np.newaxis] / narrow[:, 0])) <= 2).any(axis=1))


def _by_model(
    fit: ModalFit, lines_hz: Floats, value: Complex, f: Floats, left: NDArray[np.int64]
) -> tuple[Complex, Floats, Floats]:
    """Values as of `_between`, by the ratio of the measured to the fitted response, with the bound of the latter."""
    ratio = (value / fit.response(lines_hz))[np.newaxis]
    before, after = (parabola[0] for parabola in _parabolas(lines_hz, ratio, f, left))
    share = _share(lines_hz, f, left)
    middle = (1 - share) * before + share * after
    model = fit.response(f)
    gap = np.abs(before - after) / np.abs(middle) / 2 + _FITTED * fit.sigma(f) / np.abs(model)
    return model * middle, gap, gap


def _share(lines_hz: Floats, f: Floats, left: NDArray[np.int64]) -> Floats:
    """Share of the way from the line before to the next one."""
    return np.asarray((f - lines_hz[left]) / (lines_hz[left + 1] - lines_hz[left]))


def _to_ends(gap: Floats, share: Floats, left: NDArray[np.int64]) -> Floats:
    """At the ends only one parabola exists; the neighbouring gap stands for the missing difference."""
    for end, beside in ((0, 1), (left[-1], left[-1] - 1)):
        own, other = left == end, left == beside
        for row in gap:
            row[own] = np.maximum(row[own], np.interp(share[own], share[other], row[other]))
    return gap


def _parabolas(lines_hz: Floats, values: Complex, f: Floats, left: NDArray[np.int64]) -> tuple[Complex, Complex]:
    """Through the line before each gap, and through the line after it."""
    before, after = (_parabola(lines_hz, values, f, np.clip(left - i, 0, lines_hz.size - 3)) for i in (1, 0))
    return before, after


def _parabola(lines_hz: Floats, values: Complex, f: Floats, first: NDArray[np.int64]) -> Complex:
    """Through three lines from `first` on (Lagrange)."""
    x = [lines_hz[first + i] for i in range(3)]
    total = np.zeros((len(values), f.size), dtype=np.complex128)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        total += values[:, first + i] * ((f - x[j]) * (f - x[k]) / ((x[i] - x[j]) * (x[i] - x[k])))
    return total
