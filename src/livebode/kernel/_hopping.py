"""Spectra at a hop, by whichever is cheaper: the sliding DFT, or an FFT of every window."""

from math import log2
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from livebode.kernel import _arguments
from livebode.kernel._sliding import SlidingDFT, own_hop

_TABLE_BYTES: Final = 16 << 20  # a larger table of twiddle factors is read from memory: three times as slow
_ROWS: Final = 256  # of an FFT at once, so that they remain in the cache

Complex = npt.NDArray[np.complexfloating[Any, Any]]


def fft_is_cheaper(window: int, bin_count: int, hop: int) -> bool:
    """Whether an FFT of every window takes less time than the sliding DFT of `bin_count` bins.

    A bin and sample of the one take as long as a point and stage of the other: K·hop compared with N·log2 N, and three
    times as long where the table (8·N·K bytes) exceeds 16 MiB. With a hop of its own they take a fifth of it, and a bin
    and hop five times as long (`python -m bench.full_spectrum`).
    """
    own = own_hop(window, hop)
    time = 0.2 + 5 / own if own else 3 if 8 * window * bin_count > _TABLE_BYTES else 1
    return time * bin_count * hop > window * log2(max(window, 2))


class HoppingDFT:
    """Spectra of the last N samples at chosen bins after every `hop` samples: for many bins, up to a full spectrum.

    As `SlidingDFT.process(x, hop)`, but by an FFT of every window (NumPy's) where that is cheaper. The error is below
    5e-15 (float64) or 1e-6 (float32) of √N·‖x‖₂ of the window in both cases. The bits are those of the method that is
    used (`by_fft`): where they must be the same on every computer, use SlidingDFT.

    Parameters
    ----------
    window, bins, channels, dtype
        As for SlidingDFT.
    hop
        Samples from row to row; rows are due where the number of samples is a multiple of it.

    Raises
    ------
    ValueError
        If an argument is out of its range; the message names it, its value and the permitted values.

    Examples
    --------
    >>> dft = HoppingDFT(window=400, bins=range(201), hop=100)
    >>> dft.by_fft, dft.process(np.ones(1000)).shape
    (True, (10, 201))
    """

    def __init__(
        self,
        window: int,
        bins: npt.ArrayLike,
        hop: int,
        channels: int = 1,
        dtype: npt.DTypeLike = np.float64,
    ) -> None:
        self._window = _arguments.as_window(window)
        self._bins = _arguments.as_bins(bins, self._window)
        self._hop = _arguments.as_hop(hop)
        self._channels = _arguments.as_channels(channels)
        self._dtype = _arguments.as_dtype(dtype)
        self._sliding: SlidingDFT | None = None
        if not fft_is_cheaper(self._window, len(self._bins), self._hop):
            own = own_hop(self._window, self._hop)
            self._sliding = SlidingDFT(self._window, self._bins, self._channels, self._dtype, hop=own)
        self._last = np.zeros((self._channels, self._window), self._dtype)
        self._count = 0

    @property
    def by_fft(self) -> bool:
        """Whether rows are FFTs."""
        return self._sliding is None

    def process(self, x: npt.ArrayLike, phase: Literal["window", "fixed"] = "window") -> Complex:
        """Rows due in the next samples.

        Parameters
        ----------
        x
            Samples, (samples,) for one channel or (channels, samples).
        phase
            "window": as numpy.fft.fft of the last N samples. "fixed": referred to multiples of N.

        Returns
        -------
        array
            (rows, bins) for samples of one dimension, else (channels, rows, bins).

        Raises
        ------
        ValueError
            If the samples are not real numbers of that shape, or the phase is neither.
        """
        if self._sliding:
            return self._sliding.process(x, self._hop, phase=phase)
        if phase not in ("window", "fixed"):
            _arguments.refuse_phase(phase)
        samples = _arguments.as_samples(x, self._channels, self._dtype == np.float64)
        first = self._hop - self._count % self._hop  # samples of this call in the first row
        stream = np.concatenate([self._last, np.atleast_2d(samples)], axis=1)
        windows = np.lib.stride_tricks.sliding_window_view(stream, self._window, axis=1)
        rows = self._spectra(windows[:, first :: self._hop])
        if phase == "fixed":
            ends = self._count + first + self._hop * np.arange(rows.shape[1])
            turns = np.outer(ends % self._window, self._bins) % self._window / self._window
            rows *= np.exp(-2j * np.pi * turns).astype(rows.dtype)
        self._last = stream[:, -self._window :].copy()
        self._count += samples.shape[-1]
        return rows if samples.ndim == 2 else rows[0]

    def _spectra(self, windows: npt.NDArray[Any]) -> Complex:
        """Spectra of windows (channels, rows, N) at the bins; those above N/2 are conjugates of their mirror images."""
        kind = np.complex128 if self._dtype == np.float64 else np.complex64
        above = self._bins > self._window // 2
        places = np.where(above, self._window - self._bins, self._bins)
        spectra = np.empty((*windows.shape[:2], len(places)), kind)
        for start in range(0, windows.shape[1], _ROWS):
            some = windows[:, start : start + _ROWS].astype(np.float64)  # NumPy takes twice as long with float32
            spectra[:, start : start + _ROWS] = np.fft.rfft(some, axis=2)[:, :, places]
        spectra[:, :, above] = spectra[:, :, above].conj()
        return spectra
