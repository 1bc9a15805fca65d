"""The belt drive's constants, and its spans at a cart position."""

from __future__ import annotations

from math import sqrt
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Lt
from numpy.typing import ArrayLike

from livebode.arrays import Floats
from livebode.core import SimulationError, UsageError
from livebode.dataclass import dataclass
from livebode.simulation.values import NonNegative, Positive, nonnegative, positive


@dataclass(frozen=True, kw_only=True)
class Mechanics:
    """A tooth belt around two pulleys that moves a cart (Nevaranta 2016, eqs. (8)–(13); defaults: Table I at 0.8 m).

    The cart at x divides the lower run: l1 = x from the motor's pulley to the cart, l2 = l3 − x from the cart to the
    free pulley; l3 is the upper run. A span of length l has the stiffness c/l with one specific stiffness c, chosen so
    that Keff is `stiffness_n_per_m` at the nominal position. The damping of every span is the same fraction of its
    stiffness, so that together they damp with bs(x) = `damping_n_s_per_m`·√(Keff(x)/Keff(nominal)): a constant
    quality factor, as in Table I.

    Parameters
    ----------
    masses
        2 for (11), (12); 3 for (8)–(10), with the free pulley.
    inertia_kg_m2
        Js: inertia of motor and both pulleys, kg m².
    pulley_inertia_kg_m2
        Jp: inertia of one pulley, kg m². With two masses it is only part of Js.
    load_kg
        mL: mass of the cart, kg.
    radius_m
        r: radius of both pulleys, m.
    pulley_distance_m
        l3: distance of the pulleys, m.
    stiffness_n_per_m
        Keff: stiffness of the belt with the cart at `nominal_position_m`, N/m.
    damping_n_s_per_m
        bs: damping of the belt with the cart at `nominal_position_m`, N s/m.
    nominal_position_m
        Position of the cart to which stiffness and damping belong, m.
    frozen_position_m
        The spans are always those of the cart at this position, m: a linear machine. Default: they follow the cart.
    eccentricity
        The motor's pulley has the radius r·(1 + eccentricity·sin φ), so that the cart deviates from r·φ accordingly.
        Linearisations do not include it.

    Raises
    ------
    LivebodeError
        If a constant is not positive, or the position is not between the pulleys.

    Examples
    --------
    >>> belt = Mechanics()
    >>> float(belt.stiffness_at(0.8)), round(belt.specific_stiffness_n)
    (500000.0, 325234)
    >>> belt.stiffness_at([0.35, 1.4]).round(-3)
    array([1012000.,  345000.])
    """

    masses: Literal[2, 3] = 2
    inertia_kg_m2: Positive = 0.0028
    pulley_inertia_kg_m2: Positive = 1.8e-4
    load_kg: Positive = 6.7
    radius_m: Positive = 0.019
    pulley_distance_m: Positive = 2.14
    stiffness_n_per_m: Positive = 5.0e5
    damping_n_s_per_m: NonNegative = 130.0
    nominal_position_m: Positive = 0.8
    frozen_position_m: Positive | None = None
    eccentricity: Annotated[float, Ge(0), Lt(1)] = 0.0

    def __post_init__(self) -> None:
        if self.masses not in (2, 3):
            raise UsageError(
                "not-one-of",
                f"masses={self.masses} is not supported",
                "choose 2 or 3",
                argument="masses",
                value=self.masses,
                allowed=[2, 3],
            )
        positive(self, "inertia_kg_m2", "pulley_inertia_kg_m2", "load_kg", "radius_m", "pulley_distance_m")
        positive(self, "stiffness_n_per_m")
        nonnegative(self, "damping_n_s_per_m", "eccentricity")
        if self.eccentricity >= 1:
            raise UsageError(
                "out-of-range",
                f"eccentricity={self.eccentricity} is not below 1",
                "specify a fraction, such as 0.01 for a pulley out of centre by 1 %",
                argument="eccentricity",
                value=self.eccentricity,
                high=1,
            )
        for name in ("nominal_position_m", "frozen_position_m"):
            start_m = getattr(self, name)
            if start_m is not None and not 0 < start_m < self.pulley_distance_m:
                raise UsageError(
                    "out-of-range",
                    f"{name}={start_m} is not between the pulleys",
                    f"choose from 0 to {self.pulley_distance_m} m",
                    argument=name,
                    value=start_m,
                    low=0,
                    high=self.pulley_distance_m,
                )
        if not 2 * self.pulley_inertia_kg_m2 < self.inertia_kg_m2:
            raise SimulationError(
                "parameters-impossible",
                f"two pulleys of pulley_inertia_kg_m2={self.pulley_inertia_kg_m2} leave "
                f"nothing of inertia_kg_m2={self.inertia_kg_m2} for the motor",
                "choose less than half of it",
                parameter="pulley_inertia_kg_m2",
                value=self.pulley_inertia_kg_m2,
            )

    @property
    def motor_inertia_kg_m2(self) -> float:
        """Inertia that turns with the motor: Js with two masses, Jm + Jp = Js − Jp with three."""
        return self.inertia_kg_m2 - (self.pulley_inertia_kg_m2 if self.masses == 3 else 0.0)

    @property
    def specific_stiffness_n(self) -> float:
        """c, the stiffness of a span times its length."""
        return self.stiffness_n_per_m / float(self._shape(self.nominal_position_m))

    @property
    def damping_shape(self) -> float:
        """bs(x)/√(1/l1 + 1/(l2 + l3)), N s/√m."""
        return self.damping_n_s_per_m / sqrt(float(self._shape(self.nominal_position_m)))

    def stiffness_at(self, position_m: ArrayLike) -> Floats:
        """Keff with the cart at these positions, N/m (13)."""
        return self.specific_stiffness_n * self._shape(self.effective(position_m))

    def damping_at(self, position_m: ArrayLike) -> Floats:
        """bs with the cart at these positions, N s/m."""
        return self.damping_shape * np.sqrt(self._shape(self.effective(position_m)))

    def effective(self, position_m: ArrayLike) -> Floats:
        """The position that the spans follow."""
        given = np.asarray(position_m, dtype=np.float64)
        return given if self.frozen_position_m is None else np.full_like(given, self.frozen_position_m)

    def _shape(self, position_m: ArrayLike) -> Floats:
        cart_m = np.asarray(position_m, dtype=np.float64)
        return np.asarray(1 / cart_m + 1 / (2 * self.pulley_distance_m - cart_m))


@dataclass(frozen=True)
class Spans:
    """Stiffness, N/m, and damping, N s/m, of the three spans at one moment.

    Examples
    --------
    >>> spans = Spans.of(Mechanics(), 0.8)
    >>> round(spans.stiffness_n_per_m, 6), round(spans.damping_n_s_per_m, 9)
    (500000.0, 130.0)
    """

    stiffness: tuple[float, float, float]
    damping: tuple[float, float, float]

    @classmethod
    def of(
        cls, mechanics: Mechanics, position_m: float, stiffness_factor: float = 1.0, damping_factor: float = 1.0
    ) -> Spans:
        """The spans with the cart at `position_m`, all with the same factors on stiffness and damping."""
        cart_m = float(mechanics.effective(position_m))
        lengths = cart_m, mechanics.pulley_distance_m - cart_m, mechanics.pulley_distance_m
        shape = 1 / cart_m + 1 / (lengths[1] + lengths[2])
        c = mechanics.specific_stiffness_n * stiffness_factor
        b = mechanics.damping_shape * damping_factor / sqrt(shape)
        first, second, third = (1 / length for length in lengths)
        return cls((c * first, c * second, c * third), (b * first, b * second, b * third))

    @property
    def stiffness_n_per_m(self) -> float:
        """Keff = K1 + K2·K3/(K2 + K3) (13)."""
        return _joined(self.stiffness)

    @property
    def damping_n_s_per_m(self) -> float:
        """bs: (13) of the spans' damping, exact because all spans have the same ratio of damping to stiffness."""
        return _joined(self.damping)


def _joined(span: tuple[float, float, float]) -> float:
    first, second, third = span
    return first + (second * third / (second + third) if second + third > 0 else 0.0)
