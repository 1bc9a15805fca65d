"""Chains of masses, the motor first: their base class, one, two and three masses, and two behind an unknown gain."""

from __future__ import annotations

import re
from math import pi
from typing import Any, Literal

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import UsageError
from livebode.dataclass import dataclass
from livebode.fitting.modal import QUALITY, chain_of, scan
from livebode.fitting.physical import EvaluationGrid, Parameter, PhysicalModel, delay, free_friction, plus, times
from livebode.language import Message

# Bounds far beyond every machine: they only keep the search finite.
_INERTIA = (1e-9, 1e7)
_MASS = (1e-6, 1e9)
_STIFFNESS = (1e-6, 1e15)
_DAMPING = (1e-12, 1e12)


@dataclass(frozen=True, kw_only=True)
class Chain(PhysicalModel):
    """Base of the models of masses in a chain.

    Parameters
    ----------
    output
        "velocity" or "position".
    side
        "motor" (where the torque acts) or "load" (the last mass).
    radius_m
        Of the pulley, for a load that moves along: it then is a mass in kg, stiffness in N/m, damping in N s/m, and the
        load's output in m/s or m. None for one that turns: kg m², N m/rad, N m s/rad, rad/s or rad.
    linear
        The motor moves along too: a force in N drives masses in kg, and the output is in m/s or m.
    """

    output: Literal["velocity", "position"] = "velocity"
    side: Literal["motor", "load"] = "motor"
    radius_m: float | None = None
    linear: bool = False

    def __post_init__(self) -> None:
        _check_choice("output", self.output, ["velocity", "position"])
        _check_choice("side", self.side, ["motor", "load"])
        if self.radius_m is not None and not (np.isfinite(self.radius_m) and self.radius_m > 0):
            raise UsageError(
                "out-of-range",
                f"radius_m={self.radius_m} is not a positive number of metres per radian",
                "give the radius of the pulley",
                argument="radius_m",
                value=self.radius_m,
            )

    @property
    def arm(self) -> float:
        """r², from belt to shaft; 1 for a load that turns."""
        return 1.0 if self.radius_m is None else self.radius_m**2

    @property
    def integrators(self) -> int:
        return 1 if self.output == "velocity" else 2

    @property
    def lever(self) -> float:
        """Lever of the output: metres per radian for a load that moves along."""
        return self.radius_m if self.radius_m is not None and self.side == "load" else 1.0

    def _load(self, name: str) -> Parameter:
        if not self._moves_along:
            return Parameter(f"J{name}", "kg m²", 1e-2, *_INERTIA)
        return Parameter(f"m{name}", "kg", 10.0, *_MASS)

    def _spring(self, name: str) -> Parameter:
        unit = "N/m" if self._moves_along else "N m/rad"
        return Parameter(name, unit, 1e4, *_STIFFNESS)

    def _damper(self, name: str) -> Parameter:
        unit = "N s/m" if self._moves_along else "N m s/rad"
        return Parameter(name, unit, 10.0, *_DAMPING)

    def _motor(self) -> Parameter:
        return Parameter("Js", self._inertia_unit, 1e-2, *_INERTIA)

    @property
    def _moves_along(self) -> bool:
        """Whether the load does."""
        return self.linear or self.radius_m is not None

    @property
    def _inertia_unit(self) -> str:
        return "kg" if self.linear else "kg m²"

    @property
    def _friction_unit(self) -> str:
        return "N s/m" if self.linear else "N m s/rad"

    def shown(self, values: Floats, grid: EvaluationGrid) -> Floats:
        """Frictions that stop the motor's inertia in as long as ten of the lowest line's radians take."""
        dragged = np.array(values)
        for name in self.frictions:
            arm = self.arm if name == "BL" else 1.0
            dragged[..., self.names.index(name)] = values[..., 0] * (2 * np.pi * grid.frequency_hz.min() / 10) / arm
        return dragged

    def _whole(self, values: Floats, grid: EvaluationGrid) -> Floats:
        """Values (..., some) followed by frictions and a delay of zero."""
        others = np.zeros((*values.shape[:-1], len(self.names) - values.shape[-1]))
        return self.shown(np.concatenate([values, others], axis=-1), grid)


@dataclass(frozen=True, kw_only=True)
class Rigid(Chain):
    """One inertia, J, with viscous friction B (default: fixed at zero) and a delay.

    >>> Rigid().names
    ('J', 'B', 'delay')
    """

    name = Message("rigid")
    frictions = ("B",)

    @property
    def parameters(self) -> tuple[Parameter, ...]:  # type: ignore[override]
        inertia = Parameter("J", self._inertia_unit, 1e-2, *_INERTIA)
        return (inertia, free_friction("B", self._friction_unit), delay())

    def transfer(self, inertia: Any, friction: Any) -> tuple[list[Any], list[Any]]:
        return [self.lever], [inertia, friction] + [0.0] * (self.integrators - 1)

    def starts(self, value: Complex, weight: Floats, grid: EvaluationGrid) -> Floats:
        weights = scan(value, weight, grid, modes=0, integrators=self.integrators)[0]
        return self._whole(self.lever / weights[..., :1], grid)


@dataclass(frozen=True, kw_only=True)
class TwoMass(Chain):
    """Motor, spring and load: Nevaranta 2016, (11), (12), whose motor side is (14).

    Js, load (mL or JL), Keff and bs are fitted; B (viscous friction at the motor), BL (at the load) and delay are fixed
    at zero by default. With a known ratio of the load's inertia to the motor's, the load is not fitted.

    Parameters
    ----------
    inertia_ratio
        Load's inertia at the shaft over Js, where it is known.

    >>> TwoMass(radius_m=0.019).names
    ('Js', 'mL', 'Keff', 'bs', 'B', 'BL', 'delay')
    >>> TwoMass(linear=True).units[:4]
    ('kg', 'kg', 'N/m', 'N s/m')
    >>> TwoMass(inertia_ratio=2.0).derived_names[-1]
    'inertia_ratio'
    """

    inertia_ratio: float | None = None
    name = Message("two-mass")
    frictions = ("B", "BL")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.inertia_ratio is not None and not (np.isfinite(self.inertia_ratio) and self.inertia_ratio > 0):
            raise UsageError(
                "out-of-range",
                f"inertia_ratio={self.inertia_ratio} is not a positive number",
                "give the load's inertia by the motor's, or leave it out",
                argument="inertia_ratio",
                value=self.inertia_ratio,
            )

    @property
    def parameters(self) -> tuple[Parameter, ...]:  # type: ignore[override]
        load = () if self.inertia_ratio is not None else (self._load("L"),)
        frictions = free_friction("B", self._friction_unit), free_friction("BL", self._damper("bs").unit)
        return (self._motor(), *load, self._spring("Keff"), self._damper("bs"), *frictions, delay())

    def transfer(self, *parameters: Any) -> tuple[list[Any], list[Any]]:
        js, load, k, d, b, bl = self._at_the_shaft(*parameters)
        integrators = [0.0] * (self.integrators - 1)
        if not (np.any(b) or np.any(bl)):
            denominator = [js * load, (js + load) * d, (js + load) * k, 0.0, *integrators]
        else:
            denominator = [
                js * load,
                js * (d + bl) + load * (d + b),
                (js + load) * k + b * bl + d * (b + bl),
                k * (b + bl),
                *integrators,
            ]
        if self.side == "load":
            return [self.lever * d, self.lever * k], denominator
        return [load, d + bl, k], denominator

    @property
    def derived_names(self) -> tuple[str, ...]:
        return (*super().derived_names, "inertia_ratio")

    @property
    def derived_units(self) -> tuple[str, ...]:
        return (*super().derived_units, "")

    def derived(self, values: Floats) -> Floats:
        js, load, *_ = self._at_the_shaft(*(values[..., i] for i in range(values.shape[-1] - 1)))
        return np.concatenate([super().derived(values), (load / js)[..., np.newaxis]], axis=-1)

    def _pairs(self) -> list[str]:
        return ["resonance", "antiresonance"] if self.side == "motor" else ["resonance"]

    def _at_the_shaft(self, *p: Any) -> list[Any]:
        js, *others, friction, load_friction = p
        if self.inertia_ratio is not None:
            others = [js * self.inertia_ratio / self.arm, *others]
        return [js, *(x * self.arm for x in others), friction, load_friction * self.arm]

    def starts(self, value: Complex, weight: Floats, grid: EvaluationGrid) -> Floats:
        ratio = self.inertia_ratio
        load_side = self.side == "load"
        weights, omega = scan(
            value / self.lever, weight * self.lever, grid, modes=1, integrators=self.integrators,
            ratio=-1.0 if load_side else ratio,
        )  # fmt: skip
        if load_side:
            weights = weights[..., :1] * np.array([1.0, 1.0 if ratio is None else ratio])
        inertia, spring, damper = chain_of(weights, omega)
        parts = [inertia[..., 0], inertia[..., 1] / self.arm, spring[..., 0] / self.arm, damper[..., 0] / self.arm]
        if ratio is not None:
            del parts[1]
        return self._whole(np.stack(parts, axis=-1), grid)


def _factor(unit: str) -> str:
    return f"({unit})" if re.search(r"[\s/]", unit) else unit


_HZ = (1e-4, 1e6)
_RATIO = (1e-6, 2.0)


@dataclass(frozen=True, kw_only=True)
class TwoMassGain(PhysicalModel):
    """One antiresonance and one resonance over a rigid body, seen at the motor through an unknown gain.

    Where the input is a current and the torque constant is not known, inertia and stiffness cannot be determined:
    `gain` is the acceleration of the rigid body per unit of input, and both masses and the spring may be larger by any
    factor. The model gives the frequencies, independent damping ratios (so that friction is not restricted to a damper
    parallel to the spring), and `inertia_ratio` = (resonance/antiresonance)² − 1, load over motor.

    Parameters
    ----------
    output
        "velocity" or "position".
    output_unit, input_unit
        Their units, which that of the gain follows from; empty where they are not known.

    >>> TwoMassGain(output="position").names[:3]
    ('gain', 'antiresonance', 'resonance')
    >>> TwoMassGain(output_unit="rad/s", input_unit="A").units[0]
    'rad/s²/A'
    """

    output: Literal["velocity", "position"] = "velocity"
    output_unit: str = ""
    input_unit: str = ""
    name = Message("two-mass-gain")

    def __post_init__(self) -> None:
        _check_choice("output", self.output, ["velocity", "position"])

    @property
    def gain_unit(self) -> str:
        """Unit of an acceleration per unit of input."""
        per_s = {"velocity": "s", "position": "s²"}[self.output]
        if not self.output_unit or not self.input_unit:
            return Message("output units/{per_s} per input unit", per_s=per_s)
        angular = {"rad": "rad/s²", "rad/s": "rad/s²", "m": "m/s²", "m/s": "m/s²"}
        acceleration = angular.get(self.output_unit, f"{_factor(self.output_unit)}/{per_s}")
        return f"{acceleration}/{_factor(self.input_unit)}"

    @property
    def parameters(self) -> tuple[Parameter, ...]:  # type: ignore[override]
        return (
            Parameter("gain", self.gain_unit, 1.0, 1e-12, 1e12),
            Parameter("antiresonance", "Hz", 10.0, *_HZ),
            Parameter("resonance", "Hz", 20.0, *_HZ),
            Parameter("antiresonance_damping", "", 0.05, *_RATIO),
            Parameter("resonance_damping", "", 0.05, *_RATIO),
            delay(held=None),
        )

    def transfer(
        self, gain: Any, low: Any, high: Any, damping_low: Any, damping_high: Any
    ) -> tuple[list[Any], list[Any]]:
        low, high = 2 * pi * low, 2 * pi * high
        numerator = [gain / low**2, 2 * gain * damping_low / low, gain]
        integrators = [0.0] * (1 if self.output == "velocity" else 2)
        return numerator, [1 / high**2, 2 * damping_high / high, 1.0, *integrators]

    @property
    def derived_names(self) -> tuple[str, ...]:
        return ("antiresonance_q", "resonance_q", "inertia_ratio")

    @property
    def derived_units(self) -> tuple[str, ...]:
        return ("", "", "")

    def derived(self, values: Floats) -> Floats:
        _, low, high, damping_low, damping_high, _ = np.moveaxis(values, -1, 0)
        return np.stack([1 / (2 * damping_low), 1 / (2 * damping_high), (high / low) ** 2 - 1], axis=-1)

    def starts(self, value: Complex, weight: Floats, grid: EvaluationGrid) -> Floats:
        weights, omega = scan(value, weight, grid, modes=1, integrators=1 if self.output == "velocity" else 2)
        high, gain = omega[..., 0] / (2 * pi), weights[..., 0]
        low = high * np.sqrt(gain / weights.sum(axis=-1))
        damping = 0.5 / QUALITY * np.ones_like(gain)
        return np.stack([gain, low, high, damping, damping, 0 * gain], axis=-1)


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
        parts = [inertia[..., :1], *(x / self.arm for x in (inertia[..., 1:], spring, damper))]
        return self._whole(np.concatenate(parts, axis=-1), grid)


def _check_choice(argument: str, value: str, allowed: list[str]) -> None:
    """UsageError if a model does not have this value of an argument."""
    if value not in allowed:
        raise UsageError(
            "not-one-of",
            f"{argument}={value!r} is not supported",
            f"choose {' or '.join(map(repr, allowed))}",
            argument=argument,
            value=value,
            allowed=allowed,
        )
