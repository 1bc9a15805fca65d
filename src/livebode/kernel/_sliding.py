"""The sliding DFT: a constructor that validates its arguments for the class in C."""

from math import gcd
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from livebode.kernel import _arguments, _instructions, _native

_LEAST_HOP: Final = 8  # a shorter one takes no less time than rows after any sample (python -m bench.hop_rows)


def own_hop(window: int, hop: int) -> int | None:
    """The `hop` of a SlidingDFT whose rows are at multiples of `hop`: the longest that divides both; None if short."""
    common = gcd(window, hop)
    return common if common >= _LEAST_HOP else None


class SlidingDFT(_native.Engine):
    """Spectra of the last N samples at chosen bins, updated sample by sample.

    The modulated sliding DFT (Nevaranta 2016, Fig. 4, after Duda, IEEE SPM 27(6), 2010), with the modulator from a
    table and sums that are renewed every N samples: the error is permanently below 5e-15 (float64) or 1e-6 (float32) of
    √N·‖x‖₂ of the window, and a non-finite sample has no effect after less than 2N samples. Samples before the first
    are zeros. The results have the same bits for any division of the samples into pushes and blocks, on any machine.

    With a `hop` of its own it computes spectra after every hop-th sample only, in a third of the time: each hop by one
    matrix product with the weights of the lines, folded about the hop's centre. The bits differ from those without.

    Parameters
    ----------
    window
        N, samples; 1 … 2^24.
    bins
        Different integers 0 ≤ k < N; their order is that of the results. Bin k is k·rate/N in Hz.
    channels
        Number of signals, which share one index.
    dtype
        float64 or float32, of samples and sums; results are complex128 or complex64.
    variant
        "modulated". To compare with: "plain" (eq. (4); drifts), "damped" (biased by about N·(1 − damping)), and the
        windows "hann", "hamming" (three-bin taps) and "blackman" (five-bin taps), each exactly the DFT of the samples
        under the periodic window of that name.
    damping
        Pole radius of variant "damped"; default: 0.9999.
    hop
        A divisor of the window, or None: spectra after any sample. `process` has rows at this hop, or a multiple of it;
        `spectrum` is that after the last whole hop.

    Raises
    ------
    ValueError
        If an argument is out of its range; the message names it, its value and the permitted values.

    Examples
    --------
    >>> dft = SlidingDFT(window=8, bins=[1, 2])
    >>> dft.process([1.0, 2.0, 3.0, 4.0], hop=2).shape
    (2, 2)
    >>> bool(np.allclose(dft.spectrum(), np.fft.fft([0, 0, 0, 0, 1, 2, 3, 4])[[1, 2]]))
    True
    """

    __slots__ = ("_bins", "_damping", "_dtype", "_hop", "_variant")

    def __init__(
        self,
        window: int,
        bins: npt.ArrayLike,
        channels: int = 1,
        dtype: npt.DTypeLike = np.float64,
        variant: str = "modulated",
        *,
        damping: float | None = None,
        hop: int | None = None,
    ) -> None:
        size = _arguments.as_window(window)
        self._bins = _arguments.as_bins(bins, size)
        self._dtype = _arguments.as_dtype(dtype)
        number = _arguments.as_variant(variant)
        self._variant = variant
        self._damping = _arguments.as_damping(damping, variant)
        self._hop = _arguments.as_own_hop(hop, size, variant)
        super().__init__(
            size,
            self._bins.tolist(),
            _arguments.as_channels(channels),
            self._dtype == np.float64,
            number,
            self._damping,
            _instructions.chosen_instruction_set(),
            self._hop,
        )

    @property
    def bins(self) -> npt.NDArray[np.int64]:
        """The bins k, (bins,), read-only."""
        return self._bins

    @property
    def dtype(self) -> np.dtype[Any]:
        """Type of samples and sums: float64 or float32."""
        return self._dtype

    @property
    def variant(self) -> str:
        """Name of the variant."""
        return self._variant

    @property
    def instruction_set(self) -> str:
        """Instruction set in use: "baseline", "avx2" or "avx512"."""
        return _instructions.NAMES[self._instruction_set()]

    def __repr__(self) -> str:
        bins, hop = self._bins.tolist(), f", hop={self._hop}" if self._hop else ""
        return (
            f"SlidingDFT(window={self.window}, {bins=}, channels={self.channels}, "
            f"dtype={self._dtype}, variant={self._variant!r}{hop})"
        )
