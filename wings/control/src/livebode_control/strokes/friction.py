"""The friction of an axis in a recording: one curve for both directions, and one of each."""

from __future__ import annotations

import shlex
from typing import Any

import numpy as np

from livebode.arrays import Floats
from livebode.core import COVERAGE, SignalError
from livebode.dataclass import dataclass
from livebode.motion import FrictionCurve, friction_curve
from livebode.sources import negated
from livebode_control.strokes.motion_samples import MotionSamples

_SURE = 0.99
"""Probability with which a friction is negative, or differs between the directions."""
_USELESS = 0.5  # of a value: a bound above it, and the recording does not show the value


@dataclass(frozen=True, eq=False)
class FrictionReport:
    """Friction of an axis.

    Attributes
    ----------
    curve
        The same friction in both directions.
    directions
        With a viscous friction of each direction; its offset and asymmetry are half the differences.
    places
        With a Coulomb friction at some positions; None if it was not asked for.
    strokes
        The samples.
    """

    curve: FrictionCurve
    directions: FrictionCurve
    places: FrictionCurve | None
    strokes: MotionSamples

    def each_way(self, probability: float = COVERAGE) -> dict[str, tuple[Floats, Floats]]:
        """Coulomb and viscous friction forward and backward, with bounds, shape (2,) each."""
        return {name: self.directions.direction(sign, probability) for name, sign in (("forward", 1), ("backward", -1))}

    @property
    def differing(self) -> bool:
        """Whether the viscous friction of the directions differs, by more than its bound of 99 %."""
        index = self.directions.index("asymmetry")
        return bool(abs(self.directions.value[index]) > self.directions.bound(_SURE)[index])

    @property
    def notes(self) -> list[str]:
        """What is negative and cannot be, and what the recording does not show, as sentences."""
        found = []
        for name, remedy in _REMEDIES.items():
            value, bound = _of(self.curve, name, COVERAGE)
            shown = f"the {name} is {_text(value, bound)}"
            if value < 0:
                found.append(
                    f"{shown}: it is negative, which is not possible, so the recording does not show it; {remedy}"
                )
            elif bound > _USELESS * value:
                found.append(f"{shown}: the recording hardly shows it; {remedy}")
        return found

    def plain(self) -> dict[str, Any]:
        """Plain data for JSON."""
        each = {
            name: {"coulomb": value[0], "viscous": value[1], "coulomb_bound": bound[0], "viscous_bound": bound[1]}
            for name, (value, bound) in self.each_way().items()
        }
        return {
            **self.curve.plain(),
            "directions": each,
            "directions_differ": self.differing,
            "notes": self.notes,
            "places": None if self.places is None else self.places.plain(),
            "input": self.strokes.input,
            "output": self.strokes.output,
            "kind": self.strokes.kind,
            "recorded_samples": self.strokes.recorded,
            "used_samples": len(self.strokes.block),
        }


def friction_of(
    strokes: MotionSamples, *, places: int = 0, band_hz: float = 5.0, slowest: float | None = None
) -> FrictionReport:
    """The friction in these samples; errors as of `friction_curve`, and SignalError where it is negative."""

    def curve(directions: bool, places: int) -> FrictionCurve:
        return friction_curve(
            strokes.block,
            input=strokes.input,
            output=strokes.output,
            kind=strokes.kind,
            directions=directions,
            places=places,
            band_hz=band_hz,
            slowest=slowest,
        )

    both = curve(False, 0)
    _check_sign(both, strokes.input)
    return FrictionReport(both, curve(True, 0), curve(False, places) if places else None, strokes)


_REMEDIES = {
    "inertia": "record strokes with more acceleration",
    "coulomb": "record more strokes at several speeds, and check the sign of the input",
    "viscous": "record strokes at several speeds, farther apart",
}


def _check_sign(curve: FrictionCurve, name: str) -> None:
    """SignalError where the friction is negative at one end of the speeds, and not positive at the other."""
    value, bound = curve.at(np.array(curve.speed), _SURE)
    if not (np.any(value < -bound) and not np.any(value > bound)):
        return
    coulomb, viscous = (_text(*_of(curve, part, COVERAGE)) for part in ("coulomb", "viscous"))
    other = negated(name)
    quoted = f"'{other}'" if "'" not in other else shlex.quote(other)
    raise SignalError(
        "friction-negative",
        f"the friction is negative: Coulomb {coulomb}, viscous {viscous}; the input {name!r} has the other sign, or is "
        "not what moves the axis",
        f"give the input {quoted}, or name the channel of the torque",
        argument="input",
        value=name,
        coulomb=curve["coulomb"],
        viscous=curve["viscous"],
    )


def _of(curve: FrictionCurve, name: str, probability: float) -> tuple[float, float]:
    """Value and bound of a parameter."""
    index = curve.index(name)
    return float(curve.value[index]), float(curve.bound(probability)[index])


def _text(value: float, bound: float) -> str:
    return f"{value:.4g} ± {bound:.2g}"
