"""Phases that give a multisine a low peak, by minimisation of its L_2p norm with p rising."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from threadpoolctl import threadpool_limits

from livebode.arrays import Complex, Floats
from livebode.core import UsageError, fast_length, needing

Bins = NDArray[np.int64]

# Samples for one period of the highest line when a peak is judged: off by 3e-4 at most.
_OVERSAMPLED = 128
_LINES_WITH_HESSIAN = 200  # beyond, a Hessian takes longer than the many steps of L-BFGS
_STARTS_MAX, _STARTS_MIN = 256, 8
_STARTS_TIMES_LINES = 4848  # 48 starts for 101 lines: some seconds
_STARTS_TIMES_SAMPLES = 1 << 18  # where periods are long, each start takes them
_TOGETHER = 1 << 19  # starts·lines² in one step: 8 MB in each array
_SHAKEN_RAD = 0.5  # of Schroeder's phases: another local minimum, and not yet a random start
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


# p, each started from the previous result, and samples for one period of the highest line: the low norms find the
# valley, with few samples; the high ones find the peak, which must not be between samples.
VALLEY, PEAK = ((2, 8), (8, 8), (32, 12)), ((128, 24), (512, 24))
Stages = tuple[tuple[int, int], ...]
_STEPS, _STEPS_WITHOUT_HESSIAN = 40, 200  # for each exponent
_SETTLED = 1e-4  # of the norm in one step, for the best of all starts
_DAMPING, _DAMPING_MIN = 1e-3, 1e-8  # of Levenberg and Marquardt, relative to the Hessian's diagonal
_SAMPLES_MAX = 1 << 18


def period(bins: Bins, complexes: Complex, samples: int) -> Floats:
    """Re Σ c_k·e^(2πjkt) over one period, shape (…, samples), from c of shape (…, lines)."""
    spectrum = np.zeros((*complexes.shape[:-1], samples // 2 + 1), dtype=np.complex128)
    spectrum[..., bins] = complexes * (samples / 2)
    return np.asarray(np.fft.irfft(spectrum, samples, axis=-1))


def samples_for(highest: int, oversampled: int) -> int:
    """Number of samples of a period; fewer where a single line is very high, but above its Nyquist rate."""
    return fast_length(min(oversampled * highest, max(_SAMPLES_MAX, 3 * highest)))


def _power(x: Floats, exponent: int) -> Floats:
    """x^exponent by squaring, in a tenth of the time of NumPy's pow.

    >>> _power(np.array([2.0, -3.0]), 5).tolist()
    [32.0, -243.0]
    """
    result, square = np.ones_like(x), x
    while exponent:
        if exponent & 1:
            result *= square
        exponent >>= 1
        if exponent:
            square = square * square
    return result


def descend_together(phases: Floats, bins: Bins, amplitude: Floats, stages: Stages) -> Floats:
    """Gauss–Newton with damping from many starts at once, shape (starts, lines).

    Guillaume, Schoukens, Pintelon, Kollár, IEEE Trans. Instrum. Meas. 40(6), 1991: the norm is a sum of squares of
    x^p. JᵀJ of all pairs of lines is computed from sums and differences of their bins in one spectrum, that of the
    weights x^(2p − 2), so no Jacobian is formed.
    """
    for p, oversampled in stages:
        norm = _Norm(bins, amplitude, p, samples_for(int(bins[-1]), oversampled))
        value, peak, x = norm(phases)
        damping = np.full(len(phases), _DAMPING)
        for _ in range(_STEPS):
            step = norm.step(phases, x, damping) * peak[:, np.newaxis]
            new_value, new_peak, new_x = norm(phases - step)
            better = new_value < value
            gain = float(np.max(np.where(better, value - new_value, 0.0)))
            phases = np.where(better[:, np.newaxis], phases - step, phases)
            x = np.where(better[:, np.newaxis], new_x, x)
            peak, value = np.where(better, new_peak, peak), np.where(better, new_value, value)
            damping = np.where(better, np.maximum(damping / 3, _DAMPING_MIN), damping * 4)
            if better.any() and gain < _SETTLED:
                break
    return phases


class _Norm:
    """ln of the L_2p norm of many periods, and the step that reduces it."""

    def __init__(self, bins: Bins, amplitude: Floats, p: int, samples: int) -> None:
        self._bins, self._amplitude, self._p, self._samples = bins, amplitude, p, samples
        self._apart = bins[np.newaxis, :] - bins[:, np.newaxis]
        self._added = (bins[np.newaxis, :] + bins[:, np.newaxis]) % samples

    def __call__(self, phases: Floats) -> tuple[Floats, Floats, Floats]:
        """Norm and peak, shape (starts,), and the periods relative to their peaks."""
        x = period(self._bins, self._amplitude * np.exp(1j * phases), self._samples)
        peak = np.max(np.abs(x), axis=-1)
        x /= peak[:, np.newaxis]
        return np.log(peak) + np.log(np.mean(_power(x, 2 * self._p), axis=-1)) / (2 * self._p), peak, x

    def step(self, phases: Floats, x: Floats, damping: Floats) -> Floats:
        """(JᵀJ + damping)⁻¹·Jᵀr/(2p − 1), for a peak of 1, shape (starts, lines)."""
        lines = self._amplitude * np.exp(1j * phases)
        weights = _power(x, 2 * self._p - 2)
        slope = -np.imag(lines * np.conj(np.fft.rfft(weights * x, axis=-1)[:, self._bins]))
        spectrum = np.fft.rfft(weights, axis=-1)
        columns, rows = lines[:, np.newaxis, :], lines[:, :, np.newaxis]
        hessian = np.real(rows * columns.conj() * _at(spectrum, self._apart, self._samples))
        hessian -= np.real(rows * columns * _at(spectrum, self._added, self._samples).conj())
        hessian /= 2
        own = np.arange(self._bins.size)
        hessian[:, own, own] += (damping * np.mean(hessian[:, own, own], axis=-1))[:, np.newaxis]
        return np.asarray(np.linalg.solve(hessian, slope[..., np.newaxis])[..., 0] / (2 * self._p - 1))


def _at(spectrum: Complex, bins: Bins, samples: int) -> Complex:
    """The spectrum of a real signal at any bin, also negative ones and those above the half, shape (starts, *bins)."""
    folded = np.abs(np.where(bins > samples // 2, bins - samples, bins))
    values = spectrum[:, folded]
    return np.where((bins < 0) | (bins > samples // 2), values.conj(), values)


def descend(phases: Floats, bins: Bins, amplitude: Floats, stages: Stages) -> Floats:
    """Phases from one start, shape (lines,), by L-BFGS: for so many lines that a Hessian would take too long."""
    with needing("SciPy", "analysis", f"a design of {bins.size} lines"):
        from scipy.optimize import minimize  # a third of a second to import

    def norm(angles: Floats, p: int, samples: int) -> tuple[float, Floats]:
        lines = amplitude * np.exp(1j * angles)
        x = period(bins, lines, samples)
        peak = np.max(np.abs(x))
        x /= peak
        power = _power(x, 2 * p - 1)
        total = float(np.sum(power * x))  # no BLAS: its threads cost ten times this on a busy machine
        slope = -np.imag(lines * np.conj(np.fft.rfft(power)[bins])) / (peak * total)
        return float(np.log(peak) + np.log(total / samples) / (2 * p)), slope

    for p, oversampled in stages:
        given: Any = {"args": (p, samples_for(int(bins[-1]), oversampled)), "method": "L-BFGS-B", "jac": True}
        phases = minimize(norm, phases, **given, options={"maxiter": _STEPS_WITHOUT_HESSIAN, "maxcor": 20}).x
    return phases
