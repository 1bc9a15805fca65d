"""Test whether a recording is periodic or only appears to be."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.excitation.blocks import cut, grouped, spectra

# A resonance or a slow trajectory is similar from one period to the next, but not from one end of the recording to the
# other. So neighbouring periods are averaged to at most this many stretches, which are then compared.
_STRETCHES_MAX = 16


def log_chance(x: Floats, period: int) -> float:
    """Bound on ln of the probability that a recording without a period repeats as well as `x` does with this one.

    In each bin k of the period, with X_gk the spectra of G stretches, C = |Σ_g X_gk|²/(G·Σ_g|X_gk|²) is the share of
    power that repeats. Noise of any spectrum has P(C > c) = (1 − c)^(G − 1), whatever the power in the bin. The bins
    are ordered by their power, which is independent of C, and the 1, 2, 4, … strongest are combined; −ln of their
    probabilities add to a gamma distribution, whose tail Chernoff's inequality bounds. The result is the least of these
    times their number (Bonferroni).
    """
    groups = grouped(spectra(cut(x, period)), _STRETCHES_MAX)[:, 1:]
    count, bins = groups.shape
    if count < 2 or not bins:
        return 0.0
    total = np.sum(np.abs(groups) ** 2, axis=0)
    share = np.abs(groups.sum(axis=0)) ** 2 / (count * np.maximum(total, np.finfo(np.float64).tiny))
    # With rounding, a bin that repeats exactly has 1 − C = 1e-16 or 0.
    missing = np.clip(1 - share, np.finfo(np.float64).eps, 1.0)
    evidence = np.where(total > 0, -(count - 1) * np.log(missing), 0.0)
    sizes = 2 ** np.arange(int(np.log2(bins)) + 1)
    added = np.cumsum(evidence[np.argsort(total)[::-1]])[sizes - 1]
    added = np.maximum(added, sizes)
    return float(min(0.0, np.log(sizes.size) + np.min(sizes - added + sizes * np.log(added / sizes))))
