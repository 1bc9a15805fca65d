"""A MovingModel driven by the measured torque, the sensitivity of its motion to each parameter, and the offset."""

from __future__ import annotations

from dataclasses import field

import numpy as np

from livebode.arrays import Floats
from livebode.dataclass import dataclass
from livebode.monitoring.ripple import torques
from livebode.motion import MovingModel, late
from livebode.simulation import Pair, open_belt

FAR = 0.2
"""Difference of a logarithm: beyond it, it may be another machine, with differences that are not identified."""


@dataclass(frozen=True)
class LocalChange:
    """A bell-shaped change of ln Keff: its centre and standard deviation, m, and its depth."""

    centre_m: float
    width_m: float
    amount: float = 1.0

    def share(self, position_m: Floats) -> Floats:
        """Share of the change at these positions, 0 … 1.

        >>> LocalChange(1.0, 0.05).share(np.array([1.0, 1.05])).round(3)
        array([1.   , 0.607])
        """
        return np.asarray(np.exp(-(((position_m - self.centre_m) / self.width_m) ** 2) / 2))


@dataclass(frozen=True, eq=False)
class Offset:
    """Active changes: of the logarithms of stiffness, load, damping, inertia, (4,), and of places."""

    logarithms: Floats = field(default_factory=lambda: np.zeros(4))
    places: tuple[LocalChange, ...] = ()

    def stiffness(self, position_m: Floats) -> Floats:
        """Change of ln Keff at these positions."""
        local = [place.amount * place.share(position_m) for place in self.places]
        return np.asarray(self.logarithms[0] + np.sum(local, axis=0) * np.ones(position_m.shape))


DIRECTIONS = ("stiffness", "load", "damping", "inertia")
"""Directions of a change: Keff, mL, bs, Js; each as a small change of its logarithm."""

_STEP = 1e-3  # of a logarithm; the change is linear to a twentieth of a percent
_GRID = 4096


class Replay:
    """The model under a torque along measured positions, five times: as it is, and with each parameter a little larger.

    The origin of the torque does not matter: excitation, motion, and the controllers' response to noise move the model
    as they moved the machine, at any speed and in any direction.
    """

    def __init__(self, model: MovingModel, rate_hz: float, delay_s: float = 0.0) -> None:
        self._rate_hz, self._delay_samples, self._radius_m = rate_hz, delay_s * rate_hz, model.radius_m
        self._at = np.linspace(model.low_m, model.high_m, _GRID)
        self._stiffness, self._damping = model.stiffness_at(self._at), model.damping_at(self._at)
        self._pair = Pair(model.inertia_kg_m2, model.load_kg)

    def __call__(self, u: Floats, position_m: Floats, offset: Offset) -> tuple[Floats, Floats]:
        """Velocity of the motor from rest, rad/s (samples,), and its slopes (5, samples).

        By the logarithm of each direction, and by the velocity's delay, s.

        The model's parameters are changed by `offset`. Effects that are not in u or not in the model, such as friction,
        make the velocity drift slowly.
        """
        pair, more = self._changed(offset), 1.0 + _STEP
        pairs = [
            pair._replace(stiffness=more),
            pair._replace(load_kg=pair.load_kg * more),
            pair._replace(damping=pair.damping * more),
            pair._replace(inertia_kg_m2=pair.inertia_kg_m2 * more),
            pair,
        ]
        slopes = self._run(pairs, u, position_m, offset)  # in place: what is in the processor's cache costs less
        plain = slopes[4].copy()
        slopes[:4] -= plain
        slopes[:4] /= _STEP
        slopes[4] = -np.gradient(plain) * self._rate_hz
        return plain, slopes

    def plain(self, u: Floats, position_m: Floats, offset: Offset) -> Floats:
        """The velocity alone."""
        return np.asarray(self._run([self._changed(offset)], u, position_m, offset)[0])

    def ripple(self, cycles_per_m: Floats, position_m: Floats, shaft_m: Floats) -> Floats:
        """Velocity under cosine and sine of each order alone, of 1 N m, rad/s (2·orders, samples)."""
        torque = np.array(list(torques(cycles_per_m, shaft_m)))
        return self._run([self._pair] * len(torque), torque, position_m, Offset())

    def _changed(self, offset: Offset) -> Pair:
        """The pair with the parameters of an Offset; its stiffness is in the course of the belt."""
        factors = np.exp(offset.logarithms)
        inertia_kg_m2, load_kg = self._pair.inertia_kg_m2 * factors[3], self._pair.load_kg * factors[1]
        return Pair(float(inertia_kg_m2), float(load_kg), damping=float(factors[2]))

    def _run(self, pairs: list[Pair], torque_n_m: Floats, position_m: Floats, offset: Offset) -> Floats:
        """Velocities of the motor of each pair, rad/s (pairs, samples), from rest."""
        along = offset.stiffness(self._at) if offset.places else offset.logarithms[:1]
        course = self._stiffness * np.exp(along)
        stiffness = np.interp(position_m, self._at, course)
        damping = np.interp(position_m, self._at, self._damping)
        velocity, _ = open_belt(
            pairs, torque_n_m, stiffness, damping, rate_hz=self._rate_hz, radius_m=self._radius_m, carts=False
        )
        return late(velocity, self._delay_samples)
