"""Which poles are modes: those of the smallest sufficient order that higher orders repeat."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.dataclass import dataclass
from livebode_modes.subspace import Poles, Subspace

ORDER_MAX = 20
"""Largest order from which modes are taken."""
EXCESS_MAX = 3.0
"""A model suffices if the singular values that it leaves out are not larger than this many times their scatter."""
HIGHER_ORDERS, REPEATED_MIN = 5, 4
"""Higher orders in which a mode is looked for, and in which it must be found."""
DAMPING_MAX = 0.2
"""Poles with more damping are not listed: they describe the colour of excitation and noise."""
SHARE_MIN = 0.005
"""Share of the outputs' power; weaker modes are not listed."""
UNCERTAINTY_MAX = 0.01
"""Sigma of a mode's frequency as a share of the frequency; poles that are less certain are not listed."""
_SAME_FREQUENCY, _SAME_DAMPING = 0.01, 0.05  # relative, as usual in stabilisation diagrams (Peeters & De Roeck 2001)
_SIGMAS = 2.0  # a difference that the bounds explain is no difference


@dataclass(frozen=True, eq=False)
class Mode:
    """A mode of one window.

    Attributes
    ----------
    frequency_hz, damping
        Natural frequency and damping ratio.
    covariance
        Of both, (2, 2).
    share
        Of the power of all outputs.
    shape
        At the outputs, (outputs,), complex.
    """

    frequency_hz: float
    damping: float
    covariance: Floats
    share: float
    shape: NDArray[np.complex128]


def stable_modes(subspace: Subspace, band_hz: tuple[float, float]) -> tuple[int, list[Mode]]:
    """The model order, and the modes of a window, by frequency.

    The order is the smallest one whose left-out singular values are explained by their scatter from hop to hop, and
    whose strongest pole is a mode; higher ones have the same expected values and more variance, because they also
    describe noise. A pole is a mode if at least four of the next five orders have it within 1 % in frequency and 5 % in
    damping, or within the bounds.

    Parameters
    ----------
    band_hz
        Lowest and highest frequency of a mode.
    """
    highest = min(ORDER_MAX, subspace.order_max - 2 * HIGHER_ORDERS)
    sufficient = [n for n in range(2, highest + 1, 2) if subspace.excess(n) <= EXCESS_MAX] or [highest]
    models = cache(subspace.poles)
    for order in sufficient:
        poles = models(order)
        stable = [i for i in range(len(poles)) if _possible(poles, i, band_hz) and _stable(models, order, i)]
        if stable and int(np.argmax(poles.share)) in stable:
            break
    else:
        return sufficient[0], []
    return order, [_mode(poles, i) for i in _separate(poles, stable)]


def possible_modes(subspace: Subspace, order: int, band_hz: tuple[float, float]) -> list[Mode]:
    """Poles of a model that could be modes, whether or not models of other orders repeat them, strongest first."""
    poles = subspace.poles(min(order, subspace.order_max - 1))
    in_band = (band_hz[0] <= poles.frequency_hz) & (poles.frequency_hz <= band_hz[1])
    use = np.flatnonzero(in_band & (poles.damping > 0) & (poles.damping <= DAMPING_MAX) & (poles.share >= SHARE_MIN))
    return [_mode(poles, int(i)) for i in use[np.argsort(-poles.share[use])]]


def _separate(poles: Poles, stable: list[int]) -> list[int]:
    """The strongest of poles whose bounds do not separate them in frequency: a model may split a mode in two."""
    kept: list[int] = []
    for i in sorted(stable, key=lambda i: -poles.share[i]):
        apart = np.abs(poles.frequency_hz[kept] - poles.frequency_hz[i])
        sigma = np.sqrt(poles.covariance[kept, 0, 0] + poles.covariance[i, 0, 0])
        width = poles.damping[kept] * poles.frequency_hz[kept] + poles.damping[i] * poles.frequency_hz[i]
        if np.all(apart > np.maximum(_SIGMAS * sigma, width)):
            kept.append(i)
    return sorted(kept)


def _mode(poles: Poles, i: int) -> Mode:
    f, z = float(poles.frequency_hz[i]), float(poles.damping[i])
    return Mode(f, z, poles.covariance[i], float(min(poles.share[i], 1.0)), poles.shape[i])


def _stable(models: Callable[[int], Poles], order: int, i: int) -> bool:
    higher = (models(order + 2 * n) for n in range(1, HIGHER_ORDERS + 1))
    return sum(_repeats(model, models(order), i) for model in higher) >= REPEATED_MIN


def _possible(poles: Poles, i: int, band_hz: tuple[float, float]) -> bool:
    f, z = poles.frequency_hz[i], poles.damping[i]
    sigma_f, sigma_z = np.sqrt(np.diagonal(poles.covariance[i]))
    in_band = band_hz[0] <= f <= band_hz[1] and poles.share[i] >= SHARE_MIN
    # A growing pole is possible within its bound: a line of constant amplitude has no damping.
    return bool(in_band and -_SIGMAS * sigma_z <= z <= DAMPING_MAX and sigma_f <= max(UNCERTAINTY_MAX, z) * f)


def _repeats(model: Poles, poles: Poles, i: int) -> bool:
    """Whether a model has a pole again; one that it splits into two uncertain ones is there too."""
    f, z = poles.frequency_hz[i], poles.damping[i]
    sigma = np.sqrt(np.diagonal(poles.covariance[i] + model.covariance, axis1=-2, axis2=-1))
    same = np.abs(model.frequency_hz - f) <= np.fmax(_SAME_FREQUENCY * f, _SIGMAS * sigma[:, 0])
    same &= np.abs(model.damping - z) <= np.fmax(_SAME_DAMPING * abs(z), _SIGMAS * sigma[:, 1])
    return bool(same.any())
