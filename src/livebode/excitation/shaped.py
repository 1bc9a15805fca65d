"""Amplitudes that give all lines the same signal-to-noise ratio."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Floats
from livebode.core import UsageError


def equal_snr(response: ArrayLike, noise: ArrayLike = 1.0) -> Floats:
    """Amplitudes of the lines for the same signal-to-noise ratio at the output, shape (lines,), of rms 1.

    A_k ∝ noise_k/|Y/W|_k. The relative error of a line, sigma/|G|, is then the same for all.

    Parameters
    ----------
    response
        Y/W at the lines, from the excitation to the measured output, shape (lines,); of a machine whose response
        changes, the smallest magnitude at each line.
    noise
        Standard deviation of the output's noise, one for white noise or one for each line, in any unit.

    Raises
    ------
    UsageError
        If a response is zero or not finite: no amplitude reaches the ratio at such a line.

    Examples
    --------
    >>> equal_snr([1.0, 0.5]) * np.sqrt(2.5)
    array([1., 2.])
    """
    size = np.abs(np.asarray(response, dtype=np.complex128))
    if not size.size or not np.all(np.isfinite(size) & (size > 0)):
        line = int(np.argmin(np.where(np.isfinite(size), size, 0.0))) if size.size else 0
        raise UsageError(
            "not-finite",
            f"the response at line {line} is zero or not finite",
            "leave out that line",
            argument="response",
            line=line,
        )
    required = np.asarray(noise, dtype=np.float64) / size
    return np.asarray(required / np.sqrt(np.mean(required**2)))
