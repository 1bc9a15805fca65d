"""A chain of three masses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.fitting.chains import Chain
from livebode.fitting.modal import chain_of, scan
from livebode.fitting.physical import EvaluationGrid, Parameter, delay
from livebode.fitting.polynomials import plus, times
from livebode.language import Message


@dataclass(frozen=True, kw_only=True)
class ThreeMass(Chain):
    """Motor, middle and load, joined by two springs: torque on the first.

    At the motor any machine of one rigid and two lightly damped modes is equivalent to such a chain, also one whose
    springs form a ring, as (8) … (10); its middle mass is then not necessarily a physical part.

    >>> ThreeMass().names
    ('Js', 'J2', 'J3', 'K1', 'K2', 'b1', 'b2', 'delay')
    """

    name = Message("three-mass")

    @property
    def parameters(self) -> tuple[Parameter, ...]:  # type: ignore[override]
        springs = (self._spring("K1"), self._spring("K2"), self._damper("b1"), self._damper("b2"))
        return (self._motor(), self._load("2"), self._load("3"), *springs, delay())

    def transfer(self, *parameters: Any) -> tuple[list[Any], list[Any]]:
        js = parameters[0]
        j2, j3, k1, k2, b1, b2 = (x * self.arm for x in parameters[1:])
        # The load's side of the first spring, over s²: its dynamic stiffness N/D.
        below = [j3, b2, k2]
        above = [j2 * j3, (j2 + j3) * b2, (j2 + j3) * k2]
        joined = plus(times(above, [1.0, 0.0, 0.0]), times([b1, k1], below))
        denominator = plus(times([js], joined), times([b1, k1], above))
        numerator = joined
        if self.side == "load":
            numerator = [self.lever * x for x in times([b1, k1], [b2, k2])]
        return numerator, denominator + [0.0] * self.integrators

    def starts(self, value: Complex, weight: Floats, grid: EvaluationGrid) -> Floats:
        weights, omega = scan(value, weight, grid, modes=2, integrators=self.integrators)
        inertia, spring, damper = chain_of(weights, omega)
        found = [inertia[..., :1], *(x / self.arm for x in (inertia[..., 1:], spring, damper))]
        return self._whole(np.concatenate(found, axis=-1), grid)
