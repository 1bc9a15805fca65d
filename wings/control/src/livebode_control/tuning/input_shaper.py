"""Input shapers: the reference as a row of impulses after which little vibration remains."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from math import exp, pi, sqrt

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex, Floats
from livebode.core import Parameters, TuneError, UsageError
from livebode.dataclass import dataclass

TOLERANCE = 0.05
_FREQUENCIES, _DAMPINGS, _TURNS = 25, 3, 16
_STEPS_PER_PERIOD = 24  # of the search by linear programming
_PERIODS_MAX = 2.5
_NEGLIGIBLE = 1e-6


@dataclass(frozen=True)
class ModeRange:
    """Where a mode is, over all places with their bounds: frequency (undamped, Hz) and damping ratio."""

    low_hz: float
    high_hz: float
    low_damping: float
    high_damping: float

    @classmethod
    def of(cls, modes: Parameters, name: str = "antiresonance", probability: float = 0.95) -> ModeRange:
        """From fitted quantities: the intervals of all rows together.

        An antiresonance is the mode of the load with the motor held: what swings after a motion of a stiff drive.

        Parameters
        ----------
        modes
            With the quantities `name` in Hz and `name`_damping; of a modal fit frequency_1 and damping_1.
        name
            Of the frequency of the mode.
        probability
            Of the interval of each row.

        Raises
        ------
        TuneError
            If no row is valid.
        """
        if not modes.ok.any():
            raise TuneError(
                "no-mode",
                f"no valid fit has the mode to be shaped: {modes.status[0]}",
                "measure longer, or at more lines",
            )
        bound = modes.bound(probability)[modes.ok]
        ends = []
        damping = name.replace("frequency", "damping") if name.startswith("frequency") else f"{name}_damping"
        for column in (modes.index(name), modes.index(damping)):
            value = modes.value[modes.ok, column]
            ends += [float(np.min(value - bound[:, column])), float(np.max(value + bound[:, column]))]
        return cls(max(ends[0], 1e-3), ends[1], max(ends[2], 0.0), min(ends[3], 0.9))

    @property
    def middle(self) -> tuple[float, float]:
        """Frequency (of the mean period), Hz, and damping."""
        mean_hz = 2 / (1 / self.low_hz + 1 / self.high_hz)
        return mean_hz, (self.low_damping + self.high_damping) / 2

    @property
    def grid(self) -> tuple[Floats, Floats]:
        """Points of the range with its corners, shape (points,) each."""
        f, d = np.meshgrid(
            np.linspace(self.low_hz, self.high_hz, _FREQUENCIES),
            np.linspace(self.low_damping, self.high_damping, _DAMPINGS),
        )
        return f.ravel(), d.ravel()


@dataclass(frozen=True)
class InputShaper:
    """Impulses with which a reference is convolved; the amplitudes sum to one.

    Parameters
    ----------
    kind
        zv, zvd, ei or optimised.
    times_s, amplitudes
        The impulses, the first at 0.
    frequency_hz, damping
        Of the mode for which it was computed.
    worst
        Largest residual vibration over the range of the mode.
    """

    kind: str
    times_s: tuple[float, ...]
    amplitudes: tuple[float, ...]
    frequency_hz: float
    damping: float
    worst: float = 0.0

    @property
    def duration_s(self) -> float:
        """By which a motion becomes longer."""
        return self.times_s[-1]

    def residual(self, frequency_hz: ArrayLike, damping: ArrayLike) -> Floats:
        """Vibration that remains after the last impulse, as a share of that without a shaper.

        V = exp(−ζω·tₙ)·|Σ Aᵢ·exp((ζω + jω_d)·tᵢ)| (Singer and Seering, Preshaping command inputs to reduce system
        vibration, ASME J. Dyn. Syst. Meas. Control 112, 1990).
        """
        return np.asarray(np.abs(_phasors(np.array(self.times_s), frequency_hz, damping) @ np.array(self.amplitudes)))

    def taps(self, rate_hz: float) -> Floats:
        """Weights of the samples of a FIR filter, the newest first; an impulse between two ticks is shared by both."""
        ticks = np.array(self.times_s) * rate_hz
        taps = np.zeros(int(np.floor(ticks[-1])) + 2)
        before = np.floor(ticks).astype(int)
        np.add.at(taps, before, np.array(self.amplitudes) * (before + 1 - ticks))
        np.add.at(taps, before + 1, np.array(self.amplitudes) * (ticks - before))
        return np.trim_zeros(taps, "b")


def zv(frequency_hz: float, damping: float = 0.0) -> InputShaper:
    """Two impulses with no residual vibration of the mode (Singer and Seering 1990).

    >>> shaper = zv(50.0)
    >>> shaper.times_s, shaper.amplitudes, bool(shaper.residual(50.0, 0.0) < 1e-12)
    ((0.0, 0.01), (0.5, 0.5), True)
    """
    return _half_periods("zv", (1, 1), frequency_hz, damping)


def zvd(frequency_hz: float, damping: float = 0.0) -> InputShaper:
    """Three impulses; the derivative of the residual to the frequency is also zero (Singer and Seering 1990).

    >>> [round(a, 4) for a in zvd(50.0).amplitudes]
    [0.25, 0.5, 0.25]
    """
    return _half_periods("zvd", (1, 2, 1), frequency_hz, damping)


def ei(frequency_hz: float, damping: float = 0.0, tolerance: float = TOLERANCE) -> InputShaper:
    """Three impulses whose residual is the tolerance at the mode and zero on both sides of it: extra insensitive.

    Singhose, Seering and Singer, Residual vibration reduction using vector diagrams to generate shaped inputs, ASME J.
    Mech. Design 116, 1994. With damping, each impulse of the undamped shaper is scaled by the decay up to its time,
    which moves the zeros to modes that decay as fast.

    >>> [round(a, 4) for a in ei(50.0).amplitudes], round(float(ei(50.0).residual(50.0, 0.0)), 4)
    ([0.2625, 0.475, 0.2625], 0.05)
    """
    return _half_periods("ei", (1 + tolerance, 2 * (1 - tolerance), 1 + tolerance), frequency_hz, damping)


KINDS: dict[str, Callable[[float, float], InputShaper]] = {"zv": zv, "zvd": zvd, "ei": ei}


def optimised(mode: ModeRange, tolerance: float = TOLERANCE) -> InputShaper:
    """The shortest row of positive impulses whose residual is within the tolerance over the whole range.

    For a duration, the amplitudes on a grid of 24 times a period that have the least largest residual are a linear
    program (the size of a phasor by its projections on 16 directions, exact within 2 %); the duration is bisected.
    Compare Singhose, Command shaping for flexible systems, Int. J. Precis. Eng. Manuf. 10(4), 2009.

    Raises
    ------
    TuneError
        If no shaper of 2.5 periods of the lowest frequency has so little.
    """
    step_s = 1 / (mode.high_hz * _STEPS_PER_PERIOD)
    most = int(np.ceil(_PERIODS_MAX / mode.low_hz / step_s))
    if (best := _program(mode, most, step_s)).worst > tolerance:
        raise TuneError(
            "shaper-impossible",
            f"no shaper of {_PERIODS_MAX} periods leaves less than {100 * best.worst:.2g} % of the vibration from "
            f"{mode.low_hz:.4g} to {mode.high_hz:.4g} Hz",
            "measure with smaller bounds, or permit more",
            residual=best.worst,
        )
    low, high = 1, most
    while high - low > 1:
        middle = (low + high) // 2
        candidate = _program(mode, middle, step_s)
        if candidate.worst <= tolerance:
            high, best = middle, candidate
        else:
            low = middle
    return best


def shapers(mode: ModeRange, tolerance: float = TOLERANCE) -> tuple[InputShaper, ...]:
    """ZV, ZVD, EI and the optimised shaper for a range, each with its largest residual; the shortest first.

    The first three are computed for the frequency with the least largest residual.

    Raises
    ------
    UsageError
        If the tolerance is not between 0 and 1.
    """
    if not 0 < tolerance < 1:
        raise UsageError(
            "out-of-range", f"tolerance={tolerance} is not between 0 and 1", "0.05 is usual", argument="tolerance",
            value=tolerance,
        )  # fmt: skip
    candidates = [_best_placed(kind, mode) for kind in KINDS.values()]
    with suppress(TuneError):  # the range is too wide: the residuals of the others show how much remains
        candidates.append(optimised(mode, tolerance))
    return tuple(sorted(candidates, key=lambda shaper: shaper.duration_s))


def chosen(candidates: tuple[InputShaper, ...], tolerance: float = TOLERANCE) -> InputShaper:
    """The shortest that keeps the tolerance; where none does, the one with the least residual."""
    good = [shaper for shaper in candidates if shaper.worst <= tolerance * (1 + _NEGLIGIBLE)]
    return good[0] if good else min(candidates, key=lambda shaper: shaper.worst)


def _half_periods(kind: str, weights: tuple[float, ...], frequency_hz: float, damping: float) -> InputShaper:
    """Impulses half a damped period apart, each scaled by the decay since the first."""
    under = sqrt(1 - damping**2)
    decay = exp(-damping * pi / under)
    scaled = [w * decay**i for i, w in enumerate(weights)]
    half_s = 1 / (2 * frequency_hz * under)
    amplitudes = tuple(a / sum(scaled) for a in scaled)
    return InputShaper(kind, tuple(i * half_s for i in range(len(weights))), amplitudes, frequency_hz, damping)


def _phasors(times_s: Floats, frequency_hz: ArrayLike, damping: ArrayLike) -> Complex:
    """Vibration after the last time due to an impulse at each time, shape (..., times)."""
    omega, d = np.broadcast_arrays(2 * np.pi * np.asarray(frequency_hz), np.asarray(damping))
    pole = omega * (d + 1j * np.sqrt(1 - d**2))
    return np.asarray(np.exp(pole[..., np.newaxis] * (times_s - times_s[-1])))


def _largest(shaper: InputShaper, mode: ModeRange) -> InputShaper:
    return replace(shaper, worst=float(np.max(shaper.residual(*mode.grid))))


def _best_placed(kind: Callable[[float, float], InputShaper], mode: ModeRange) -> InputShaper:
    from scipy.optimize import minimize_scalar

    damping = mode.middle[1]
    if mode.high_hz - mode.low_hz < 1e-9 * mode.high_hz:
        return _largest(kind(mode.low_hz, damping), mode)
    best = minimize_scalar(
        lambda f: _largest(kind(f, damping), mode).worst, bounds=(mode.low_hz, mode.high_hz), method="bounded"
    )
    return _largest(kind(float(best.x), damping), mode)


def _program(mode: ModeRange, steps: int, step_s: float) -> InputShaper:
    """Amplitudes at times up to `steps`·step with the least largest residual."""
    from scipy.optimize import linprog

    times_s = np.asarray(step_s * np.arange(steps + 1), dtype=np.float64)
    phasors = _phasors(times_s, *mode.grid)
    turns = np.exp(1j * np.pi * np.arange(_TURNS) * 2 / _TURNS)
    rows = np.real(phasors[np.newaxis] * turns[:, np.newaxis, np.newaxis]).reshape(-1, times_s.size)
    solution = linprog(
        np.append(np.zeros(times_s.size), 1.0),
        A_ub=np.column_stack([rows, -np.ones(len(rows))]),
        b_ub=np.zeros(len(rows)),
        A_eq=np.append(np.ones(times_s.size), 0.0)[np.newaxis],
        b_eq=[1.0],
        method="highs",
    )
    every = np.asarray(solution.x, dtype=np.float64)[:-1]
    use = every > _NEGLIGIBLE
    amplitudes = every[use] / every[use].sum()
    times = times_s[use] - times_s[use][0]
    return _largest(InputShaper("optimised", tuple(times.tolist()), tuple(amplitudes.tolist()), *mode.middle), mode)
