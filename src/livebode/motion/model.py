"""MovingModel: two masses whose stiffness and damping follow a position."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Floats
from livebode.dataclass import dataclass
from livebode.kernel import CurveShape, curve_at, curve_splines

_DEGREE = 3  # cubic: the stiffness of a belt has no bend
_SHOWN = 11
_BEYOND = 0.1  # of the range, on either side, where a curve continues straight


@dataclass(frozen=True, eq=False)
class PositionCurve:
    """A smooth function of the position: a cubic spline with evenly spaced knots.

    Outside of its range it continues straight for a tenth of the range, and is constant beyond.

    Parameters
    ----------
    low, high
        Range of positions, m.
    weights
        One for each B-spline, shape (splines,), at least four; a single one is a constant.
    """

    low: float
    high: float
    weights: Floats

    def __call__(self, position_m: ArrayLike) -> Floats:
        position = np.asarray(position_m, dtype=np.float64)
        if len(self.weights) == 1:
            return np.full(position.shape, self.weights[0])
        knots, slope, reach = _knots(self.low, self.high, len(self.weights))
        rise, fall = slope * (self.weights[1] - self.weights[0]), slope * (self.weights[-1] - self.weights[-2])
        shape = CurveShape(knots, self.weights, reach, float(rise), float(fall))
        return curve_at(shape, np.ascontiguousarray(position.ravel())).reshape(position.shape)


def _knots(low: float, high: float, splines: int) -> tuple[Floats, float, float]:
    """Knots; slope at an end per difference of its two weights; length of the straight extension."""
    inner = np.linspace(low, high, splines - _DEGREE + 1)
    knots = np.concatenate([np.full(_DEGREE, low), inner, np.full(_DEGREE, high)])
    return knots, _DEGREE / float(inner[1] - inner[0]), _BEYOND * (high - low)


def basis(position_m: Floats, low: float, high: float, splines: int) -> Floats:
    """Value of every B-spline at these positions, shape (positions, splines); one of them alone is 1."""
    if splines == 1:
        return np.ones((position_m.size, 1))
    knots, rise, reach = _knots(low, high, splines)
    value = curve_splines(knots, np.ascontiguousarray(position_m))
    slope = rise * np.array([-1.0, 1.0])
    value[:, :2] += np.outer((position_m - low).clip(-reach, 0.0), slope)
    value[:, -2:] += np.outer((position_m - high).clip(0.0, reach), slope)
    return value


@dataclass(frozen=True, eq=False)
class MovingModel:
    """The fitted model: two masses (11), (12) with Keff(x) and bs(x).

    Attributes
    ----------
    inertia_kg_m2, load_kg, radius_m
        Js, mL, r.
    low_m, high_m
        Range of positions of the fit.
    delay_s
        Delay of the measured velocity after the torque, beyond that of two masses behind a zero-order hold.
    """

    inertia_kg_m2: float
    load_kg: float
    radius_m: float
    log_stiffness: PositionCurve
    log_damping: PositionCurve
    delay_s: float = 0.0

    @property
    def rigid_kg_m2(self) -> float:
        """Js + mL·r²."""
        return self.inertia_kg_m2 + self.load_kg * self.radius_m**2

    @property
    def low_m(self) -> float:
        return self.log_stiffness.low

    @property
    def high_m(self) -> float:
        return self.log_stiffness.high

    def stiffness_at(self, position_m: ArrayLike) -> Floats:
        """Keff, N/m; it is extended by a tenth of the fit's range on either side."""
        return np.asarray(np.exp(self.log_stiffness(position_m)))

    def damping_at(self, position_m: ArrayLike) -> Floats:
        """bs, N s/m; likewise."""
        return np.asarray(np.exp(self.log_damping(position_m)))

    def plain(self) -> dict[str, Any]:
        """Plain data of the model: masses and radius, and the belt at eleven positions of the range."""
        shown_m = np.linspace(self.low_m, self.high_m, _SHOWN)
        return {
            "inertia_kg_m2": self.inertia_kg_m2,
            "load_kg": self.load_kg,
            "radius_m": self.radius_m,
            "delay_s": self.delay_s,
            "position_m": shown_m.tolist(),
            "stiffness_n_per_m": self.stiffness_at(shown_m).tolist(),
            "damping_n_s_per_m": self.damping_at(shown_m).tolist(),
        }

    def parameters(self, position_m: ArrayLike) -> Floats:
        """Logarithms in the order of `two_masses`, shape (..., 4)."""
        position, arm = np.asarray(position_m, dtype=np.float64), 2 * np.log(self.radius_m)
        js, load = np.log(self.inertia_kg_m2), np.log(self.load_kg) + arm
        constant = np.ones(position.shape)
        return np.stack(
            [js * constant, load * constant, self.log_stiffness(position) + arm, self.log_damping(position) + arm],
            axis=-1,
        )
