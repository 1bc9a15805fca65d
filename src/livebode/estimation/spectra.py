"""From samples to line spectra: complete windows, and the processing of a signal before and after the DFT."""

from __future__ import annotations

import os
from dataclasses import field
from math import gcd
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import GridError, Lines, Stage, StatefulBase, UsageError
from livebode.dataclass import dataclass
from livebode.estimation.implausible import PlausibleRange, SpikeGate
from livebode.kernel import INSTRUCTION_SET_VARIABLE, SlidingDFT, instruction_set, instruction_sets, own_hop

_NONE = np.zeros(0, dtype=np.intp)
_ROW_VALUES_MAX = 1 << 18  # complex numbers of one kernel call: 4 MiB, which fits the cache


@dataclass(frozen=True, eq=False)
class SpectraRows:
    """Line spectra at the hops of a stretch of samples.

    `spectrum` is (channels, rows, bins) with the phase of a fixed grid of period N, so that rows compare with each
    other and channels divide; `sample` (rows,) the newest sample of each; `whole` (rows,) False where the window holds
    a start, a gap, or a non-finite or implausibly large sample, `clean` (rows,) False also where it contains a
    spike or a sample that is left out; `not_finite`, `implausible`, `spikes` and `left_out` are the positions of such
    samples in the stretch.
    """

    spectrum: Complex
    sample: NDArray[np.int64]
    whole: NDArray[np.bool_]
    clean: NDArray[np.bool_]
    not_finite: NDArray[np.intp]
    implausible: NDArray[np.intp]
    spikes: NDArray[np.intp]
    left_out: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, dtype=np.intp))


class LineSpectra(StatefulBase):
    """Sliding DFT of several signals that records gaps, non-finite samples and spikes of each window.

    Hops count within the period: rows are at the multiples of `hop` in each period, so that every row has one
    exactly a period before it. Where `hop` does not divide N, the last step of each period is longer. A hop of several
    windows counts within itself.

    Parameters
    ----------
    window, bins, hop
        N and hop in samples, bins as whole numbers.
    differenced
        For each signal, whether it is differenced before the DFT and divided by 1 − z⁻¹ after it: for a signal that
        drifts, whose steps from period to period would leak.
    advanced
        For each signal, ticks by which its spectrum is advanced (z^ticks).
    spikes
        Gate that finds samples to exclude, or None.
    dtype
        Of the samples and of the DFT; what is done to a signal before and after it is in float64.
    """

    _stage = Stage("line-spectra", 2)
    _STATE = ("_range", "_spikes", "_next", "_last_bad", "_before", "_started")

    def __init__(
        self,
        window: int,
        bins: NDArray[np.int64],
        hop: int,
        differenced: NDArray[np.bool_],
        advanced: NDArray[np.int64],
        spikes: SpikeGate | None,
        dtype: Literal["float64", "float32"] = "float64",
    ) -> None:
        self._window, self._bins, self._hop, self._dtype = window, bins, hop, np.dtype(dtype)
        self._step = gcd(hop, window)
        self._differenced = differenced
        self._spikes = spikes
        self._range = PlausibleRange(differenced.size, window)
        self._after = after(bins, window, differenced, advanced)
        self._plain = bool(np.all(self._after == 1))
        self._dft = self._fresh()
        self._next = -1
        self.known_spikes = np.zeros(0, dtype=np.int64)
        self.left_out = np.zeros(0, dtype=np.int64)
        self._last_bad = [-1, -1]  # numbers of the last sample that was not finite, and of the last spike
        self._before = np.zeros(differenced.size)
        self._started = False

    def _fresh(self) -> SlidingDFT:
        check_instruction_set()
        hop = own_hop(self._window, self._step)
        return SlidingDFT(self._window, self._bins, channels=self._differenced.size, dtype=self._dtype, hop=hop)

    def restart(self, sample: int) -> None:
        """Forget every sample; the next one has this number."""
        self._dft = self._fresh()
        # Zeros up to the place in the period, so that the grid of hops and phases is that of the sample numbers.
        self._dft.advance(np.zeros((self._differenced.size, sample % self._window)))
        self._next = sample
        self._last_bad = [sample - 1, sample - 1]
        self._started = False
        if self._spikes is not None:
            self._spikes.restart(sample)

    def _state(self) -> dict[str, Any]:
        return super()._state() | {"dft": self._dft.snapshot()}

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        self._dft.restore(state["dft"])

    def process(self, data: Floats) -> SpectraRows:
        """Rows of the next samples, `data` (channels, samples); samples that are not finite make rows not whole."""
        with np.errstate(over="ignore", invalid="ignore"):  # a value too large for the dtype becomes infinite
            finite = self._prepare(data)
        sizes, not_finite = self._range.sizes(finite), _NONE
        if not np.isfinite(sizes).all():
            bad = ~np.isfinite(finite).all(axis=0)
            finite, not_finite = np.where(bad, 0.0, finite), np.flatnonzero(bad)
            sizes = self._range.sizes(finite)
        implausible = self._range.process(finite, sizes)
        if implausible.size:
            finite = finite.copy()
            finite[:, implausible] = 0.0
        missing = _joined(not_finite, implausible)
        # The substitute for a missing sample may differ, but is not a spike of the signal.
        spikes = _NONE
        if self._spikes is not None:
            known = self._positions(self.known_spikes, data.shape[1])
            spikes = np.setdiff1d(np.union1d(self._spikes.process(finite), known), missing)
        left_out = self._positions(self.left_out, data.shape[1])
        step = max(self._step, _ROW_VALUES_MAX // (self._after.size or 1) * self._step)
        parts = [self._spectra(finite[:, i : i + step], i) for i in range(0, finite.shape[1], step)]
        spectrum, position = parts[0]
        if len(parts) > 1:
            spectrum = np.concatenate([p[0] for p in parts], axis=1)
            position = np.concatenate([p[1] for p in parts])
        whole = self._without(missing, 0, data.shape[1], position)
        clean = whole & self._without(_joined(spikes, left_out), 1, data.shape[1], position)
        rows = SpectraRows(spectrum, self._next + position, whole, clean, not_finite, implausible, spikes, left_out)
        self._next += data.shape[1]
        return rows

    def _positions(self, samples: NDArray[np.int64], count: int) -> NDArray[np.intp]:
        """Positions of these samples, by number and ascending, in the next `count` ones."""
        if not samples.size:
            return _NONE
        first, stop = np.searchsorted(samples, (self._next, self._next + count))
        return np.asarray(samples[first:stop] - self._next, dtype=np.intp)

    def _prepare(self, data: Floats) -> Floats:
        if self._dtype != data.dtype:
            data = data.astype(self._dtype).astype(np.float64)
        if self._differenced.any():
            if not self._started:  # the first sample has none before it, and so belongs to no whole window
                self._before = data[:, 0].copy()
                self._last_bad[0] += 1
                self._started = True
            shifted = np.concatenate([self._before[:, np.newaxis], data[:, :-1]], axis=1)
            self._before = data[:, -1].copy()
            data = np.where(self._differenced[:, np.newaxis], data - shifted, data)
        return data

    def _spectra(self, data: Floats, offset: int) -> tuple[Complex, NDArray[np.int64]]:
        first = (self._next + offset) % self._window
        spectrum = self._dft.process(data, hop=self._step, phase="fixed")
        # Rows follow the samples whose count is a multiple of the step, which divides the window.
        position = np.arange(self._step - first % self._step - 1, data.shape[1], self._step)
        if self._step != self._hop:
            if self._hop > self._window:
                chosen = (self._next + offset + position + 1) % self._hop == 0
            else:
                place = (first + position + 1) % self._window
                chosen = (place % self._hop == 0) & (place > 0)
            spectrum, position = spectrum[:, chosen], position[chosen]
        if not self._plain:
            spectrum = spectrum * self._after[:, np.newaxis, :]
        return np.asarray(spectrum, dtype=np.complex128), (position + offset).astype(np.int64)

    def _without(
        self, bad: NDArray[np.intp], kind: int, samples: int, position: NDArray[np.int64]
    ) -> NDArray[np.bool_]:
        last_bad: int | NDArray[np.int64] = self._last_bad[kind]
        if bad.size:
            number = np.full(samples, last_bad)
            number[bad] = self._next + bad
            number = np.maximum.accumulate(number)
            self._last_bad[kind], last_bad = int(number[-1]), number[position]
        return np.asarray(self._next + position - last_bad >= self._window)


def _joined(first: NDArray[np.intp], second: NDArray[np.intp]) -> NDArray[np.intp]:
    """Positions joined in order; the second are nearly always none."""
    return np.concatenate([first, second]) if second.size else first


def after(bins: NDArray[np.int64], window: int, differenced: NDArray[np.bool_], advanced: NDArray[np.int64]) -> Complex:
    """Factor of the spectra at each bin: z^advanced, over 1 − z⁻¹ where signals are differenced."""
    z = np.exp(2j * np.pi * bins / window)
    factor = z ** advanced[:, np.newaxis]
    factor[differenced] /= 1 - 1 / z
    return np.asarray(factor)


def check_instruction_set() -> None:
    """UsageError if the environment names an instruction set that the kernel does not have."""
    try:
        instruction_set()
    except ValueError:
        name, allowed = os.environ[INSTRUCTION_SET_VARIABLE], ["best", *instruction_sets()]
        raise UsageError(
            "not-one-of",
            f"the environment variable {INSTRUCTION_SET_VARIABLE}={name!r} is not one of the instruction sets of this "
            "computer",
            f"unset it, or choose {', '.join(allowed)}",
            argument=INSTRUCTION_SET_VARIABLE,
            value=name,
            allowed=allowed,
        ) from None


class Hann:
    """X_k/2 − (X_{k−1} + X_{k+1})/4, the periodic Hann window in the frequency domain (Jacobsen & Lyons 2003).

    It reduces the weight of the window's ends, where a moving axis was at other positions, for 1.5 times the noise.
    Lines must be two bins apart, otherwise the excitation of neighbouring lines leaks in.
    """

    def __init__(self, lines: Lines) -> None:
        apart = np.diff(lines.bins)
        if apart.size and apart.min() < 2:
            raise GridError(
                "lines-too-close",
                f"with a Hann window lines must be 2 bins ({2 * lines.resolution_hz:g} Hz) apart, but two are closer",
                "take a longer window or fewer lines",
                argument="lines",
                resolution_hz=lines.resolution_hz,
            )
        if lines.bins[0] < 2 or 2 * (lines.bins[-1] + 1) >= lines.window:
            raise GridError(
                "line-at-edge",
                f"with a Hann window lines must be 2 bins ({2 * lines.resolution_hz:g} Hz) "
                "from 0 and 1 from the Nyquist frequency",
                "leave out the outermost line",
                argument="lines",
                resolution_hz=lines.resolution_hz,
            )
        self._window = lines.window
        lines_bins = np.asarray(lines.bins)
        self.bins = np.unique(np.concatenate([lines_bins - 1, lines_bins, lines_bins + 1]))
        self._at = np.searchsorted(self.bins, lines_bins)

    def combine(self, spectrum: Complex, place: NDArray[np.int64]) -> Complex:
        """Windowed lines (channels, rows, lines) from spectra (channels, rows, bins) on the fixed phase grid.

        `place` (rows,) is the number of each window's newest sample, plus one, modulo N.
        """
        # On the fixed grid bin k lags the window's own phase by k(n + 1)/N turns; neighbours differ by one such step.
        turn = np.exp(2j * np.pi * place / self._window)[:, np.newaxis]
        below, above = spectrum[..., self._at - 1], spectrum[..., self._at + 1]
        return np.asarray(0.5 * spectrum[..., self._at] - 0.25 * (below * turn.conj() + above * turn))
