"""Phases that give a multisine a low peak."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from threadpoolctl import threadpool_limits

from livebode.arrays import Floats
from livebode.core import UsageError
from livebode.excitation.descent import PEAK, VALLEY, Stages, descend, descend_together, period, samples_for

Bins = NDArray[np.int64]

# Samples for one period of the highest line when a peak is judged: off by 3e-4 at most.
_OVERSAMPLED = 128
_LINES_WITH_HESSIAN = 200
_STARTS_MAX, _STARTS_MIN = 256, 8
_STARTS_TIMES_LINES = 4848  # 48 starts for 101 lines: some seconds
_STARTS_TIMES_SAMPLES = 1 << 18  # where periods are long, each start takes them
_TOGETHER = 1 << 19  # starts·lines² in one step: 8 MB in each array
_SHAKEN_RAD = 0.5
_PROMISING = 4  # one in this many is optimised further to the peak


def low_crest_phases(
    bins: ArrayLike, amplitude: ArrayLike = 1.0, *, seed: int = 0, starts: int | None = None
) -> Floats:
    """Phases of Σ A_i·sin(2πk_i·t + φ_i) for a low peak, radians, shape (lines,).

    The L_2p norm of the period is minimised over the phases with p rising to 512, after Guillaume, Schoukens,
    Pintelon, Kollár (IEEE Trans. Instrum. Meas. 40(6), 1991). A descent ends in the local minimum of its start, so
    there are many starts: the first has Schroeder's phases, half are perturbations of these, half are random. A quarter
    continue to the highest p, and the lowest crest factor is selected. The same seed gives the same phases.
    wings/design/docs/excitation.md compares the results with other methods.

    Parameters
    ----------
    bins
        Of the lines, whole numbers above 0, ascending, shape (lines,).
    amplitude
        One for all lines, or one for each.
    seed
        Of the starts.
    starts
        Number of starts; None for some seconds of search: 230 for 21 lines, 48 for 101, 8 for 600, one for 5,000.

    Raises
    ------
    UsageError
        If amplitudes are not as many as bins, or `starts` is below 1.

    Examples
    --------
    >>> phases = low_crest_phases(range(1, 8), starts=32)
    >>> round(crest_between_samples(range(1, 8), 1.0, phases), 2)
    1.41
    """
    k, size = _reduced(bins, amplitude)
    count = _starts_for(k) if starts is None else starts
    if count < 1:
        raise UsageError(
            "out-of-range", f"{starts=} is below 1", "give at least one start", argument="starts", value=starts, low=1
        )
    # Threads for such small products wait for each other; on a busy machine the search takes several times longer.
    with threadpool_limits(1, user_api="blas"):
        return np.asarray((_searched(k, size, seed, count) + np.pi / 2) % (2 * np.pi))  # of sines, found as cosines


def _searched(k: Bins, size: Floats, seed: int, count: int) -> Floats:
    """The phases of cosines at the end of the best start."""
    generator = np.random.default_rng(seed)
    at_once = max(1, _TOGETHER // k.size**2) if k.size <= _LINES_WITH_HESSIAN else 1
    promising: list[tuple[float, Floats]] = []
    for first in range(0, count, at_once):
        begun = _starts(np.arange(first, min(first + at_once, count)), size, generator)
        promising += _descended(begun, k, size, VALLEY)
        promising = sorted(promising, key=_first)[: -(-count // _PROMISING)]
    ended: list[tuple[float, Floats]] = []
    for first in range(0, len(promising), at_once):
        ended += _descended(np.array([p for _, p in promising[first : first + at_once]]), k, size, PEAK)
    return min(ended, key=_first)[1]


def _starts_for(k: Bins) -> int:
    many = int(np.clip(_STARTS_TIMES_LINES // k.size, _STARTS_MIN, _STARTS_MAX))
    return min(many, max(1, _STARTS_TIMES_SAMPLES // samples_for(int(k[-1]), VALLEY[-1][1])))


def _first(result: tuple[float, Floats]) -> float:
    return result[0]


def _descended(begun: Floats, k: Bins, size: Floats, stages: Stages) -> list[tuple[float, Floats]]:
    """Crest factor and phases at the end of each start."""
    if k.size <= _LINES_WITH_HESSIAN:
        ended = descend_together(begun, k, size, stages)
    else:
        ended = np.array([descend(phases, k, size, stages) for phases in begun])
    return [(_crest(k, size, phases), phases) for phases in ended]


def crest_between_samples(bins: ArrayLike, amplitude: ArrayLike, phases: ArrayLike) -> float:
    """Crest factor of Σ A_i·sin(2πk_i·t + φ_i) in continuous time (128 samples in a period of the highest line).

    >>> round(crest_between_samples([1], 1.0, [0.3]), 3)
    1.414
    """
    k, size = _reduced(bins, amplitude)
    return _crest(k, size, np.asarray(phases, dtype=np.float64) - np.pi / 2)


def _starts(numbers: NDArray[np.int64], amplitude: Floats, generator: np.random.Generator) -> Floats:
    """Schroeder's phases (number 0), these with perturbations (even), and random ones (odd)."""
    shape = (numbers.size, amplitude.size)
    shaken = _schroeder(amplitude) + generator.normal(0, _SHAKEN_RAD, shape) * (numbers > 0)[:, np.newaxis]
    anywhere = generator.uniform(0, 2 * np.pi, shape)
    return np.where((numbers % 2 == 0)[:, np.newaxis], shaken, anywhere)


def _schroeder(amplitude: Floats) -> Floats:
    """−2π·Σ_{j<i} (i − j)·p_j, where p_j is a line's share of the power (Schroeder 1970, for any amplitudes)."""
    share = amplitude**2 / np.sum(amplitude**2)
    return np.asarray(-2 * np.pi * np.concatenate(([0.0], np.cumsum(np.cumsum(share))[:-1])))


def _reduced(bins: ArrayLike, amplitude: ArrayLike) -> tuple[Bins, Floats]:
    """Bins without their common divisor, which changes no peak, and as many amplitudes."""
    k = np.asarray(bins, dtype=np.int64)
    size = np.asarray(amplitude, dtype=np.float64)
    if size.shape not in ((), k.shape):
        raise UsageError(
            "wrong-shape",
            f"amplitude has shape {size.shape} for {k.size} lines",
            "give one number, or one for each line",
            argument="amplitude",
            shape=list(size.shape),
            lines=int(k.size),
        )
    if not k.size or k.min() < 1:
        raise UsageError(
            "out-of-range",
            f"bins={k.tolist()} are not whole numbers above 0",
            "specify at least one line",
            argument="bins",
            value=k.tolist(),
            low=1,
        )
    if not np.all(np.isfinite(size)) or not np.any(size):
        raise UsageError(
            "not-finite",
            "the amplitudes are not finite, or all zero",
            "specify one above 0 for each line",
            argument="amplitude",
        )
    return k // np.gcd.reduce(k), np.broadcast_to(size, k.shape)


def _crest(k: Bins, size: Floats, phases: Floats) -> float:
    samples = period(k, size * np.exp(1j * phases), samples_for(int(k[-1]), _OVERSAMPLED))
    return float(np.max(np.abs(samples)) / np.sqrt(np.sum(size**2) / 2))
