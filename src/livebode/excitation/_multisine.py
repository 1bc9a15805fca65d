"""One exact period of a multisine."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Floats
from livebode.core import Lines, UsageError
from livebode.excitation.low_crest import low_crest_phases

Phases = Literal["schroeder", "random", "low crest"]


def schroeder_phases(count: int) -> Floats:
    """Phases φ_i = π·i·(i − 1)/count of lines i = 1 … count, radians, shape (count,).

    Nevaranta 2016, eq. (7), φ_k = (k − 1)πk/k_max, taken over the number of the line and not over its bin: over bins
    20:20:140 Hz would get the phases of a signal with 14 lines, of which it has every second, and the crest factor
    would depend on the window. Schroeder (IEEE Trans. Inf. Theory 16, 1970) writes −πi(i − 1)/count: the other sign
    plays the same period backwards with its sign turned, so the crest factor is the same: 1.90 … 1.92 for 7 to 240 flat
    lines from the first bin on.

    >>> schroeder_phases(3) / np.pi
    array([0.        , 0.66666667, 2.        ])
    """
    i = np.arange(1, count + 1)
    return np.pi * i * (i - 1) / count


def multisine(
    lines: Lines, amplitude: ArrayLike = 1.0, phases: ArrayLike | Phases = "schroeder", *, seed: int = 0
) -> Floats:
    """One period of Σ A_k·sin(2πkn/N + φ_k), n = 0 … N − 1, shape (lines.window,), unit of `amplitude`.

    Nevaranta 2016, eq. (6). The angle is reduced as an integer, kn mod N, before the conversion to float, so that
    sample n + N of an endless excitation has the bits of sample n, and no line drifts from its bin.

    Parameters
    ----------
    lines
        Excited lines; the period is their window.
    amplitude
        One for all lines, or one for each.
    phases
        ``"schroeder"``, eq. (7); ``"random"``, uniform, for detecting distortion; ``"low crest"``, searched for seconds
        (`low_crest_phases`); or radians for each line.
    seed
        Of random and low-crest phases.

    Raises
    ------
    UsageError
        If amplitudes or phases are not finite or are not as many as lines.

    Examples
    --------
    >>> lines = Lines.parse("20:140:20", rate_hz=4000, window=200)
    >>> period = multisine(lines, amplitude=0.5)
    >>> len(period), round(float(np.std(period)) ** 2, 6)
    (200, 0.875)
    """
    each_amplitude = each(amplitude, len(lines), "amplitude")
    angles = _named(phases, lines, each_amplitude, seed) if isinstance(phases, str) else phases
    each_angle = each(angles, len(lines), "phases")
    n = np.arange(lines.window, dtype=np.int64)
    period = np.zeros(lines.window)
    for k, size, phase in zip(lines.bins, each_amplitude, each_angle):
        period += size * np.sin((2 * np.pi / lines.window) * ((k * n) % lines.window) + phase)
    return period


def _named(phases: str, lines: Lines, amplitude: Floats, seed: int) -> Floats:
    if phases == "schroeder":
        return schroeder_phases(len(lines))
    if phases == "random":
        return np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines))
    if phases == "low crest":
        return low_crest_phases(lines.bins, amplitude, seed=seed)
    raise UsageError(
        "not-one-of",
        f"{phases=} is not supported",
        "choose 'schroeder', 'random', 'low crest', or give radians for each line",
        argument="phases",
        value=str(phases),
        allowed=list(get_args(Phases)),
    )


def each(value: ArrayLike, count: int, name: str) -> Floats:
    """One finite number for each of `count` lines, shape (count,); UsageError where they are not."""
    given = np.asarray(value, dtype=np.float64)
    if given.shape not in ((), (count,)):
        raise UsageError(
            "wrong-shape",
            f"{name} has shape {given.shape} for {count} lines",
            "give one number, or one for each line",
            argument=name,
            shape=list(given.shape),
            lines=count,
        )
    if not np.all(np.isfinite(given)):
        raise UsageError(
            "not-finite",
            f"{name}={given[~np.isfinite(given)].flat[0]} is not finite",
            "give finite numbers",
            argument=name,
        )
    return np.broadcast_to(given, (count,))
