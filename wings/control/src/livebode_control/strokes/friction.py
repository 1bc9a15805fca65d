"""The friction of an axis in a recording: one curve for both directions, and one of each."""

from __future__ import annotations

from typing import Any

from livebode.arrays import Floats
from livebode.core import COVERAGE
from livebode.dataclass import dataclass
from livebode.motion import FrictionCurve, friction_curve
from livebode_control.strokes.motion_samples import MotionSamples


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
        return bool(abs(self.directions.value[index]) > self.directions.bound(0.99)[index])

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
    """The friction in these samples; errors as of `friction_curve`."""

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

    return FrictionReport(curve(False, 0), curve(True, 0), curve(False, places) if places else None, strokes)
