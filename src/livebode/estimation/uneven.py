"""Line spectra of samples at uneven times, by least squares at the times themselves, and the responses from them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import Stage
from livebode.dataclass import dataclass
from livebode.estimation.spectra_tracker import SpectraTracker

_ONE, _X, _U, _UU, _XU = range(5)  # rows of the sums; the last three for a trend
_TABLE = 32  # powers of e^(jφ) that one factor covers
_PIECE = 1 << 20  # complex numbers at a time


@dataclass(frozen=True, eq=False)
class UnevenWindow:
    """Spectra of a window of the channels of one clock.

    Attributes
    ----------
    sums
        N·c(k) at the lines, with x(t) ≈ Σ 2·Re(c(k)·e^(j2πkt/T)), and the scaled sums of the residual at the detection
        lines; 0 where `inflation` is infinite. Shape (channels, bins).
    inflation
        Variance at each line over that of as many even samples, shape (channels, lines); infinite where the
        samples do not determine the lines.
    samples
        Finite samples, shape (channels,).
    """

    sums: Complex
    inflation: Floats
    samples: NDArray[np.int64]


class UnevenSpectra:
    """Spectra at lines of channels that share a clock, by least squares at the times of their samples.

    The model of a window is a constant, optionally a linear trend, and a cosine and a sine at each line. The estimate
    is unbiased for any times if these are the times at which the signal was sampled, and if the signal between the
    lines is noise that does not depend on them. It is biased if the stamps are wrong instead of the sampling: a line at
    f is then smaller by the mean of e^(j2πf·error), 1 − 2(πf·std)² for independent errors. The variance is that of an
    even DFT times `inflation`; a signal of other frequencies becomes noise, which differs from period to period.
    On even samples the sums at the lines equal those of the DFT.

    Windows consist of segments. The normal equations of a segment are sums of e^(j2πmt/T) over its samples, so that
    each sample is used once. With one line these are the sums of a generalised Lomb-Scargle periodogram (Zechmeister
    and Kürster 2009).

    Parameters
    ----------
    lines, quiet
        Bins k of the lines, and of the detection lines, ascending.
    window
        N: a window is one period T, or N samples of the common grid.
    places
        Segments in a window.
    samples
        Expected samples of this clock in a window.
    trend
        For each channel, whether the model contains a linear trend: for a signal that drifts.
    """

    def __init__(
        self,
        lines: tuple[int, ...],
        quiet: tuple[int, ...],
        window: int,
        places: int,
        samples: float,
        trend: list[bool],
    ) -> None:
        k, q = np.array(lines), np.array(quiet, dtype=np.int64)
        self._k, self._q, self._trend = k, q, np.array(trend)
        self._window, self._places, self._samples = window, places, samples
        self._minus, self._plus = k[:, np.newaxis] - k, k[:, np.newaxis] + k
        beside = [k[:, np.newaxis] - q, k[:, np.newaxis] + q, q]
        needed = [np.abs(part).ravel() for part in (self._minus, self._plus, k, *beside)]
        self._orders = np.unique(np.concatenate([[0], *needed]))
        self._at = np.zeros(int(self._orders[-1]) + 1, dtype=np.intp)
        self._at[self._orders] = np.arange(self._orders.size)
        self._rows = 5 if any(trend) else 2

    def segment(self, turns: Floats, x: Floats) -> Complex:
        """Sums of the samples of a segment, shape (channels, rows, orders).

        Parameters
        ----------
        turns
            Times in periods, shape (samples,).
        x
            Samples, shape (channels, samples); those that are not finite are left out.
        """
        sums = np.zeros((len(x), self._rows, self._orders.size), dtype=np.complex128)
        size = max(1, _PIECE // self._orders.size)
        for i in range(0, turns.size, size):
            sums += self._sums(turns[i : i + size], x[:, i : i + size])
        return sums

    def _sums(self, turns: Floats, x: Floats) -> Complex:
        known = np.isfinite(x)
        weights, values = known.astype(np.float64), np.where(known, x, 0.0)
        parts = [weights, values]
        if self._rows == 5:
            # A segment begins half a sample before its first one on the common grid.
            u = ((turns + 0.5 / self._window) * self._places) % 1.0 - 0.5
            parts += [weights * u, weights * u * u, values * u]
        rows = np.stack(parts, axis=1)
        turn = np.exp(2j * np.pi * (turns % 1.0))
        fine = turn[:, np.newaxis] ** np.arange(_TABLE)
        coarse = (turn**_TABLE)[:, np.newaxis] ** np.arange(self._orders[-1] // _TABLE + 1)
        powers = fine[:, self._orders % _TABLE] * coarse[:, self._orders // _TABLE]
        return np.asarray(rows @ powers)

    def window(self, segments: Complex) -> UnevenWindow:
        """The spectra of a window from the sums of its segments in order, (places, channels, rows, orders)."""
        sums = self._together(segments)
        spectra = np.zeros((len(sums), self._k.size + self._q.size), dtype=np.complex128)
        inflation = np.full((len(sums), self._k.size), np.inf)
        samples = np.rint(sums[:, _ONE, 0].real).astype(np.int64)
        solved: dict[tuple[bytes, bool], Floats | None] = {}
        for row, (own, trend) in enumerate(zip(sums, self._trend)):
            key = own[[_ONE, *([_U, _UU] if trend else [])]].tobytes(), bool(trend)
            if key not in solved:
                solved[key] = self._covariance(own, bool(trend))
            inverse = solved[key]
            if inverse is not None:
                spectra[row], inflation[row] = self._solve(own, bool(trend), inverse)
        return UnevenWindow(spectra, inflation, samples)

    def _together(self, segments: Complex) -> Complex:
        """Sums over the window, with the trend's time from its centre in windows."""
        sums = segments.sum(axis=0)
        if self._rows == 5:
            shift = (np.arange(self._places) - (self._places - 1) / 2)[:, np.newaxis, np.newaxis]
            weights, x, u, uu, xu = np.moveaxis(segments, 2, 0)
            sums[:, _U] = (u + shift * weights).sum(axis=0) / self._places
            sums[:, _XU] = (xu + shift * x).sum(axis=0) / self._places
            sums[:, _UU] = (uu + 2 * shift * u + shift**2 * weights).sum(axis=0) / self._places**2
        return np.asarray(sums)

    def _covariance(self, sums: Complex, trend: bool) -> Floats | None:
        """Inverse of the normal matrix of constant, trend, cosines and sines; None where it is singular."""
        weights = sums[_ONE]
        c_minus, c_plus = weights.real[self._at[np.abs(self._minus)]], weights.real[self._at[self._plus]]
        s_minus = np.sign(self._minus) * weights.imag[self._at[np.abs(self._minus)]]
        s_plus = weights.imag[self._at[self._plus]]
        first, lines = 1 + trend, self._k.size
        size = first + 2 * lines
        if weights[0].real < size:
            return None
        normal = np.empty((size, size))
        cos, sin = slice(first, first + lines), slice(first + lines, None)
        normal[cos, cos], normal[sin, sin] = (c_minus + c_plus) / 2, (c_minus - c_plus) / 2
        normal[cos, sin] = (s_plus - s_minus) / 2
        head = self._head(sums, trend)
        normal[:first, cos], normal[:first, sin] = head[:, self._at[self._k]].real, head[:, self._at[self._k]].imag
        normal[0, 0] = weights[0].real
        if trend:
            normal[0, 1], normal[1, 1] = sums[_U, 0].real, sums[_UU, 0].real
        normal = np.triu(normal) + np.triu(normal, 1).T
        try:
            np.linalg.cholesky(normal)
        except np.linalg.LinAlgError:
            return None
        return np.asarray(np.linalg.inv(normal))

    def _head(self, sums: Complex, trend: bool) -> Complex:
        """Sums of the constant, and of the trend, at all orders."""
        return sums[[_ONE, _U][: 1 + trend]]

    def _solve(self, sums: Complex, trend: bool, inverse: Floats) -> tuple[Complex, Floats]:
        first, lines = 1 + trend, self._k.size
        columns = self._at[self._k]
        ends = sums[[_X, _XU][:first], 0].real
        answer = np.concatenate([ends, sums[_X, columns].real, sums[_X, columns].imag])
        solution = inverse @ answer
        line = (solution[first : first + lines] - 1j * solution[first + lines :]) / 2
        spread = np.diag(inverse)[first:].reshape(2, lines).sum(axis=0) / 4
        quiet = self._quiet(sums, trend, inverse, solution) * np.sqrt(spread.mean())
        return self._window * np.concatenate([line, quiet]), spread * self._samples

    def _quiet(self, sums: Complex, trend: bool, inverse: Floats, solution: Floats) -> Complex:
        """Sums of the residual at the detection lines, scaled to unit variance for white noise of unit variance."""
        if not self._q.size:
            return np.zeros(0, dtype=np.complex128)
        weights, k = sums[_ONE], self._k[:, np.newaxis]
        minus = weights[self._at[np.abs(k - self._q)]]
        minus = np.where(k < self._q, minus.conj(), minus)
        plus = weights[self._at[k + self._q]].conj()
        head = self._head(sums, trend)[:, self._at[self._q]].conj()
        basis = np.concatenate([head, (minus + plus) / 2, (minus - plus) / 2j])
        residual = sums[_X, self._at[self._q]].conj() - solution @ basis
        left = weights[0].real - np.einsum("pq,pr,rq->q", basis.conj(), inverse, basis).real
        return np.asarray(residual / np.sqrt(np.maximum(left, 1.0)))

    def windows(self, segments: Iterator[Complex], first: int, every: int) -> Iterator[UnevenWindow]:
        """The windows that end with every `every`-th segment, of consecutive segments from number `first` on."""
        ring = np.zeros((self._places, self._trend.size, self._rows, self._orders.size), dtype=np.complex128)
        for number, sums in enumerate(segments, start=first):
            ring[number % self._places] = sums
            if number - first + 1 < self._places or (number + 1) % every:
                continue
            order = (np.arange(self._places) + number + 1) % self._places
            yield self.window(ring[order])


class UnevenTracker(SpectraTracker):
    """A SpectraTracker for recordings whose channels have clocks of their own.

    What the uneven times add to the error of a spectrum differs from period to period, and is in sigma as all of the
    scatter is.
    """

    _stage = Stage("uneven-tracker", 1)
    _sentences: Mapping[str, str] = {
        "not-whole": "a window has too few samples of a channel",
        "implausible": "a spectrum is more than 1e8 times larger than all in the period before",
        "spike": "a window has a spike",
    }

    def found(self) -> dict[str, Any]:
        """The basis of the responses as plain data for a record."""
        return super().found() | {"from": "samples at their own times"}
