"""The lines of an excitation that is recorded at uneven times."""

from __future__ import annotations

from math import gcd

import numpy as np

from livebode.arrays import Complex
from livebode.core import Lines, SignalError
from livebode.estimation import UnevenSpectra
from livebode.preparation.uneven_segments import segments
from livebode.sources import UnevenLog

_BLOCKS = 16
_BINS_MAX = 1024
_SAMPLES_PER_UNKNOWN = 3
_INFLATION_MAX = 10.0
_RUNS = 0.5  # of the usual power: less is a block in which the excitation does not run


def excited_lines(log: UnevenLog, name: str, window: int) -> Lines:
    """The lines of a channel that repeats every `window` samples of the grid, in its shortest period.

    All bins are fitted together to the samples of several periods, at their times: what is between the lines does not
    leak into them, and blocks of periods differ by noise only.

    Raises
    ------
    SignalError
        If there are less than two periods, or no line exceeds the noise.
    """
    from livebode.excitation import find_lines  # slow to import

    spectra = _block_spectra(log, name, window)
    power = np.sum(np.abs(spectra) ** 2, axis=1)
    spectra = spectra[power >= _RUNS * np.median(power)]
    bins = [int(k) for k in np.flatnonzero(find_lines(spectra).excited)] if len(spectra) > 1 else []
    if not bins:
        raise SignalError(
            "no-line-above-noise",
            f"no line of the period of {window} samples exceeds the noise of {len(spectra)} parts of {name!r}",
            "record more periods, or raise the amplitude",
            period=window,
        )
    common = gcd(window, *bins)
    if common > 1:  # a shorter period has more samples for each bin, so that higher ones can be seen
        return excited_lines(log, name, window // common)
    return Lines.of_bins(bins, window, log.rate_hz)


def _block_spectra(log: UnevenLog, name: str, window: int) -> Complex:
    """Amplitudes at the bins in each of up to 16 parts of the recording, shape (parts, bins)."""
    periods = log.samples // window
    blocks = min(_BLOCKS, periods)
    if blocks < 2:
        raise SignalError(
            "too-short",
            f"the recording has {log.samples} samples of the grid of {log.rate_hz:.6g} Hz, less than two periods of "
            f"{window}",
            "record at least two periods",
            samples=log.samples,
            window=window,
        )
    many = periods // blocks
    first = -(-log.first // window)
    expected = log.clocks([name])[0].stamps.rate_hz * window / log.rate_hz
    most = max(1, min(_BINS_MAX, (window - 1) // 2, int(expected * many / (2 * _SAMPLES_PER_UNKNOWN))))
    # Whole windows from the first one on, `many` in each part.
    parts = list(segments(log, [name], first, first + (periods - 1) // many * many, window))
    joined = [parts[i : i + many] for i in range(0, len(parts) - many + 1, many)]
    found = np.zeros((len(joined), most + 1), dtype=np.complex128)
    while most:
        fit = UnevenSpectra(tuple(range(1, most + 1)), (), window, 1, expected * many, [False])
        windows = [
            fit.window(
                fit.segment(
                    np.concatenate([at for at, _ in part]) / window, np.concatenate([x for _, x in part], axis=1)
                )[np.newaxis]
            )
            for part in joined
        ]
        if np.median([one.inflation.max() for one in windows]) < _INFLATION_MAX:
            whole = [i for i, one in enumerate(windows) if np.isfinite(one.inflation).all()]
            found = found[: len(whole), : most + 1]
            found[:, 1:] = [windows[i].sums[0] * (2 / window) for i in whole]
            return found
        most //= 2
    return found[:0]
