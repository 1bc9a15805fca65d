"""Quotients of responses of signals to a reference: by local polynomials, and by averages of windows (Welch)."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import Lines, Stage, StatefulBase, UsageError
from livebode.dataclass import dataclass
from livebode.estimation.tracker_settings import WINDOWS


@dataclass(frozen=True, eq=False)
class Quotient:
    """Responses of signals to a reference, with a factor of their noise.

    Attributes
    ----------
    gains
        Response of each signal to the reference, shape (signals, lines); NaN where it cannot be determined.
    residual
        Factor F of the noise in the signals' spectra, shape (lines, any, signals): the noise of Σ a_i·S_i has the
        variance |F·a|².
    variance
        Variance of a gain over that of the noise, shape (lines,).
    dof
        Complex degrees of freedom of the noise; the least of all lines.
    power
        Mean |R|² around each line, shape (lines,).
    """

    gains: Complex
    residual: Complex
    variance: Floats
    dof: float
    power: Floats

    def noise(self, weights: Complex) -> Floats:
        """Power of the noise in Σ a_i·S_i, shape (lines,); `weights` has the shape (signals, lines)."""
        return np.asarray(np.sum(np.abs(np.einsum("krs,sk->kr", self.residual, weights)) ** 2, axis=1))


def triangular(equations: Complex) -> Complex:
    """Triangular factor R of equations, R*R = A*A, shape (lines, unknowns, unknowns)."""
    return np.asarray(np.linalg.qr(equations, mode="r"))


HALF_WIDTH = 6
"""Bins on each side of a line that its polynomials are fitted to."""
WIDTH = 2 * HALF_WIDTH + 1
WINDOW_MIN = 2 * WIDTH + 1
"""Samples in a window that has this many bins between 0 and the Nyquist frequency."""
_COUNT = 3  # coefficients of a polynomial of order 2
_FREE = WIDTH - _COUNT  # equations of a window after its transient is eliminated
# Singular values below this are the rounding of bins without excitation, next to a line of a periodic one.
_RANK = 1e-10
_SEEN = 1 - 1e-6  # share of the value at the line in directions that the windows determine; less is extrapolated


class LocalPolynomial(StatefulBase):
    """Y(k + r) = G(r)·R(k + r) + T(r) + V(k + r) around each line k, with parabolas G and T over r = −6 … 6.

    T is the transient: what the samples before the window still cause in it, less what those in it cause after it. It
    is different in each window and is eliminated by a projection, which is the same for all lines. The rest is kept as
    a triangular factor, so that windows add up without loss of the noise to rounding.

    Parameters
    ----------
    lines
        The lines; window and bins.
    signals
        Number of signals besides the reference.
    places
        Windows that begin within one window, each with its own sums; 0 to forget every window.
    forgetting
        Weight of a window relative to the next one at its place.
    """

    _stage = Stage("local-polynomial", 1)
    _STATE = ("_triangle", "_information", "_power", "_weights")

    def __init__(self, lines: Lines, signals: int, places: int, forgetting: float) -> None:
        bins, last = np.asarray(lines.bins), (lines.window - 1) // 2
        if last < WIDTH:
            raise UsageError(
                "out-of-range",
                f"a window of {lines.window} samples has {last} bins, but a local polynomial needs {WIDTH}",
                f"choose a window of at least {WINDOW_MIN} samples",
                argument="window",
                value=lines.window,
                low=WINDOW_MIN,
            )
        first = np.clip(bins - HALF_WIDTH, 1, last - WIDTH + 1)
        self._at = first[:, np.newaxis] + np.arange(WIDTH)
        distance = (self._at - bins[:, np.newaxis]) / HALF_WIDTH
        self._powers = distance[..., np.newaxis] ** np.arange(_COUNT)
        steps = np.linspace(-1, 1, WIDTH)[:, np.newaxis] ** np.arange(_COUNT)
        self._without_transient = np.linalg.qr(steps, mode="complete")[0][:, _COUNT:].T
        size = _COUNT + signals
        self._forgetting = forgetting
        self._triangle = np.zeros((places, bins.size, size, size), dtype=np.complex128)
        self._information = np.zeros((places, bins.size, _COUNT, _COUNT), dtype=np.complex128)
        self._power = np.zeros((places, bins.size))
        self._weights = np.zeros((places, 2))

    def process(self, samples: Floats, place: int) -> Quotient:
        """Quotients of a window, or of it and those before it at its place.

        `samples` is the window of the reference and of the signals, shape (1 + signals, window).
        """
        local = np.fft.rfft(samples)[:, self._at]
        regression = local[0][..., np.newaxis] * self._powers
        equations = self._without_transient @ np.concatenate([regression, np.moveaxis(local[1:], 0, -1)], axis=-1)
        columns = equations[..., :_COUNT]
        information = _adjoint(columns) @ columns
        weights, power = np.ones(2), np.mean(np.abs(local[0]) ** 2, axis=-1)
        if not len(self._triangle):
            return _solved(triangular(equations), information, weights, power)
        kept = np.array([self._forgetting, self._forgetting**2])
        equations = np.concatenate([np.sqrt(kept[0]) * self._triangle[place], equations], axis=-2)
        triangle = triangular(equations)
        weights = weights + kept * self._weights[place]
        information = information + kept[1] * self._information[place]
        power = self._power[place] + (power - self._power[place]) / weights[0]
        self._triangle[place], self._information[place] = triangle, information
        self._power[place], self._weights[place] = power, weights
        return _solved(triangle, information, weights, power)


def _solved(triangle: Complex, information: Complex, weights: Floats, power: Floats) -> Quotient:
    """Quotient of the parabolas' values at the line, from the triangular factor of [regression, signals]."""
    # A window whose squares overflow has no quotient.
    triangle = np.where(np.isfinite(triangle).all(axis=(1, 2), keepdims=True), triangle, 0.0)
    left, right, residual = triangle[:, :_COUNT, :_COUNT], triangle[:, :_COUNT, _COUNT:], triangle[:, _COUNT:, _COUNT:]
    u, size, v = np.linalg.svd(left)
    used = size > _RANK * size[:, :1]
    share = np.divide(1.0, size, out=np.zeros_like(size), where=used & (size > 0))
    inverse = (_adjoint(v) * share[:, np.newaxis]) @ _adjoint(u)
    coefficients = inverse @ right
    residual = np.concatenate([right - left @ coefficients, residual], axis=1)
    root = inverse @ _adjoint(inverse)  # of the covariance of the coefficients, for windows of equal weight
    spread = root @ information
    variance = (spread @ root)[:, 0, 0].real
    free = _FREE * weights[0] - np.trace(spread, axis1=1, axis2=2).real
    seen = np.sum(np.abs(np.where(used[..., np.newaxis], v, 0.0)[..., 0]) ** 2, axis=1) >= _SEEN
    rank = np.count_nonzero(used, axis=1)
    dof = _FREE * weights[0] ** 2 / weights[1] - rank
    gains = coefficients[:, 0].T
    return Quotient(
        gains=np.where(seen, gains, complex(np.nan, np.nan)),
        residual=residual / np.sqrt(free)[:, np.newaxis, np.newaxis],
        variance=variance,
        dof=float(dof[seen].min()) if seen.any() else np.nan,
        power=power,
    )


def _adjoint(matrix: Complex) -> Complex:
    return np.asarray(np.swapaxes(matrix.conj(), -1, -2))


class WelchAverage(StatefulBase):
    """H1 or the joint estimate from Hann windows that overlap by half; see `livebode.estimation._welch` for its bias.

    Parameters
    ----------
    lines
        The lines; window and bins.
    signals
        Number of signals besides the reference.
    places
        Stretches that begin within one stretch, each with its own sums; 0 to forget every stretch.
    forgetting
        Weight of a stretch relative to the next one at its place.
    """

    _stage = Stage("welch-average", 1)
    _STATE = ("_triangle", "_weights")

    def __init__(self, lines: Lines, signals: int, places: int, forgetting: float) -> None:
        self._window, self._bins, self._forgetting = lines.window, np.asarray(lines.bins), forgetting
        self._taper = np.hanning(lines.window + 1)[:-1]
        self._step = (lines.window + 1) // 2
        self._starts = np.arange(0, (WINDOWS - 1) * lines.window + 1, self._step)
        self._independent = independent_windows(self._starts.size, self._step, self._taper)
        self._triangle = np.zeros((places, self._bins.size, 1 + signals, 1 + signals), dtype=np.complex128)
        self._weights = np.zeros((places, 2))

    def process(self, samples: Floats, place: int) -> Quotient:
        """Quotients of a stretch, or of it and those before it at its place.

        `samples` is the stretch of the reference and of the signals, shape (1 + signals, WINDOWS·window).
        """
        windows = np.stack([samples[:, start : start + self._window] for start in self._starts])
        tapered = (windows - windows.mean(axis=-1, keepdims=True)) * self._taper
        equations = np.moveaxis(np.fft.rfft(tapered)[..., self._bins], -1, 0)  # (lines, windows, 1 + signals)
        weights = np.ones(2)
        if not len(self._triangle):
            return self._solved(triangular(equations), weights)
        kept = np.array([self._forgetting, self._forgetting**2])
        equations = np.concatenate([np.sqrt(kept[0]) * self._triangle[place], equations], axis=-2)
        triangle, weights = triangular(equations), weights + kept * self._weights[place]
        self._triangle[place], self._weights[place] = triangle, weights
        return self._solved(triangle, weights)

    def _solved(self, triangle: Complex, weights: Floats) -> Quotient:
        count = weights[0] * self._starts.size
        independent = self._independent * weights[0] ** 2 / weights[1]
        power = np.abs(triangle[:, 0, 0]) ** 2 / count
        with np.errstate(divide="ignore", invalid="ignore"):
            return Quotient(
                gains=(triangle[:, 0, 1:] / triangle[:, 0, :1]).T,
                residual=triangle[:, 1:, 1:] * np.sqrt(independent / (count * (independent - 1))),
                variance=1 / (independent * power),
                dof=float(independent - 1),
                power=power,
            )


def independent_windows(count: int, step: int, taper: Floats) -> float:
    """Equivalent number of windows without overlap (Welch 1967), for noise that is smooth over a bin."""
    window = taper.size
    shifts = np.arange(1, min(count, -(-window // step)))
    overlaps = np.array([np.dot(taper[k * step :], taper[: window - k * step]) for k in shifts])
    correlation = (overlaps / np.dot(taper, taper)) ** 2
    return float(count / (1 + 2 * np.sum((1 - shifts / count) * correlation)))
