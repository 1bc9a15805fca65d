"""Detection of periods that differ from the steady ones."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Flags, Floats
from livebode.core import normal_quantile
from livebode.excitation._medians import medians
from livebode.excitation.blocks import spectra
from livebode.kernel import period_reach

FALSE_ALARM = 1e-3  # probability that any period of a recording is marked by chance
# With fewer periods there is no majority of steady ones.
_PERIODS_MIN = 3
# Two periods differ only by rounding below this share of their size.
ROUNDING = 1e-9
# A period is marked only from three times the usual distance: noise of a machine is seldom stationary, and a period
# with twice the usual noise is still useful.
FACTOR_MIN = 3.0


def unlike(blocks: Floats, excited: Flags) -> Flags:
    """Periods that differ from the median period by more than their noise, shape (periods,).

    Parameters
    ----------
    blocks
        Periods without drift, shape (periods, samples).
    excited
        Bins of the excitation, shape (bins,).

    Notes
    -----
    Two distances: at the excited lines, |X_mk − X̃_k|² in units of its usual size at line k, averaged over lines, which
    finds a transient at a weak line below the noise of a strong one; and the largest difference of a sample, which
    finds a spike. Each is compared, in logarithms, with its median over the periods and their spread (median absolute
    deviation, a scale that less than half of the periods cannot move). Biased where more than half of the
    recording is transient: then the transient counts as usual.
    """
    count = len(blocks)
    if count < _PERIODS_MIN:
        return np.zeros(count, dtype=np.bool_)
    if not excited.any():
        return np.zeros(count, dtype=np.bool_)
    lines = spectra(blocks, excited)
    real = medians(lines.real, axis=0)
    away = np.abs(lines - real - 1j * medians(lines.imag, axis=0)) ** 2
    usual = medians(away, axis=0) + (ROUNDING * np.abs(real)) ** 2
    usual += np.finfo(np.float64).tiny
    at_lines = np.sqrt(np.mean(away / usual, axis=1))
    at_samples, size = period_reach(blocks, medians(blocks, axis=0))
    return _far(at_lines, np.zeros(count)) | _far(at_samples, ROUNDING * _median(size))


def leading(flags: Flags) -> int:
    """Number of consecutive marked periods from the start."""
    return int(np.argmin(flags)) if not flags.all() else 0


def _far(distance: Floats, rounding: float | Floats) -> Flags:
    # Equal periods have the distance 0; adding the rounding keeps the logarithm.
    log = np.log(distance + rounding + np.finfo(np.float64).tiny)
    middle = _median(log)
    spread = _median(np.abs(log - middle)) / normal_quantile(0.75)
    sigmas = -normal_quantile(FALSE_ALARM / len(log))
    return np.asarray(log > middle + max(sigmas * spread, np.log(FACTOR_MIN)))


def _median(x: Floats) -> np.float64:
    return np.float64(medians(x[np.newaxis], axis=1)[0])
