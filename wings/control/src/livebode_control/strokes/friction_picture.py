"""The picture of a friction curve: measured friction over speed, and the fitted curve with its band."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from livebode.pictures import (
    ABOVE,
    BELOW,
    LIGHT,
    Band,
    Bars,
    Dots,
    Entry,
    Figure,
    Mark,
    Panel,
    Trace,
    room,
    save_svg,
    scale_around,
    value_scale,
)

if TYPE_CHECKING:
    from livebode.motion import FrictionCurve

_POINTS = 200
_DOTS = 4000


class FrictionCurves(Protocol):
    """The part of a friction report that is drawn."""

    @property
    def curve(self) -> FrictionCurve: ...
    @property
    def directions(self) -> FrictionCurve: ...
    @property
    def places(self) -> FrictionCurve | None: ...


def save_friction_picture(curves: FrictionCurves, path: Path, *, title: str = "") -> Path:
    """Write the picture."""
    return save_svg(friction_figure(curves, title=title), path)


def friction_figure(curves: FrictionCurves, *, title: str = "") -> Figure:
    """Friction over speed: dots are the smoothed input without inertia and constant force, the band covers 95 %.

    The dashed line is that of each direction. With places, Coulomb friction over the position is below.
    """
    curve, each = curves.curve, curves.directions
    dots = friction_dots(curve)
    marks: list[Mark] = [dots]
    drawn = [dots.y]
    for sign in (-1, 1):
        v = sign * np.linspace(max(curve.speed[0], 1e-3 * curve.speed[1]), curve.speed[1], _POINTS)
        value, bound = curve.at(v)
        marks.append(Band("bound", v, value - bound, value + bound, LIGHT.run, 0.25))
        marks.append(Trace("both", v, value, LIGHT.run, 1.8))
        marks.append(Trace("each", v, _with_offset(each, curve, v), LIGHT.newest, 1.2, "dashed"))
        drawn += [value - bound, value + bound]
    unit = curve.units[curve.index("coulomb")]
    reach = 1.04 * max(float(np.abs(dots.x).max(initial=0.0)), curve.speed[1])
    x, y = (
        value_scale(-reach, reach, labelled("speed", speed_unit(curve))),
        scale_around(drawn, labelled("friction", unit)),
    )
    left, height = room(y), 260.0
    zero: list[Mark] = [
        Trace("zero", np.array([-reach, reach]), np.zeros(2), LIGHT.muted, 0.8),
        Trace("zero", np.zeros(2), np.array([y.low, y.high]), LIGHT.muted, 0.8),
    ]
    panels = [Panel(left, ABOVE, 588.0 - left, height, x, y, [*zero, *marks])]
    top = ABOVE + height + BELOW
    if curves.places is not None:
        panels.append(_places(curves.places, labelled("Coulomb friction", unit), top + ABOVE))
        top += ABOVE + panels[-1].height + BELOW
    key = (
        Entry("measured", LIGHT.muted, "dot"), Entry("both directions, 95 %", LIGHT.run),
        Entry("each direction", LIGHT.newest, "dashed"),
    )  # fmt: skip
    return Figure(title or "Friction", _facts(curve), key, panels, top)


def friction_dots(curve: FrictionCurve) -> Dots:
    """Measured friction over speed; of many values some."""
    speed, friction = curve.measured[:, :: max(curve.measured.shape[1] // _DOTS, 1)]
    return Dots("measured", speed, friction, LIGHT.muted, 2.0, alpha=0.35)


def _places(curve: FrictionCurve, label: str, top: float) -> Panel:
    indices = [curve.index(f"coulomb_{j + 1}") for j in range(curve.places.size)]
    value, bound = curve.value[indices], curve.bound()[indices]
    y = scale_around([value - bound, value + bound], label)
    x = scale_around([curve.places], "position")
    left = room(y)
    marks = (
        Trace("coulomb", curve.places, value, LIGHT.run, 1.4),
        Bars("bound", curve.places, value - bound, value + bound, LIGHT.run),
        Dots("coulomb", curve.places, value, LIGHT.run),
    )
    return Panel(left, top, 588.0 - left, 150.0, x, y, marks)


def _with_offset(each: FrictionCurve, curve: FrictionCurve, v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Friction of each direction, drawn around the same constant force as the dots."""
    return np.asarray(each.at(v)[0] + each["offset"] - curve["offset"])


def speed_unit(curve: FrictionCurve) -> str:
    """Unit of the speed, from that of viscous friction; empty without one."""
    unit = curve.units[curve.index("viscous")]
    return unit.rpartition("/(")[2].removesuffix(")") if unit else ""


def labelled(name: str, unit: str) -> str:
    """A label with its unit, if there is one."""
    return f"{name}, {unit}" if unit else name


def _facts(curve: FrictionCurve) -> list[str]:
    bound = curve.bound()
    shown = {"coulomb": "Coulomb", "viscous": "viscous", "stribeck": "Stribeck", "inertia": "inertia"}
    return [
        f"{shown[name]} {curve.value[i]:.4g} ± {bound[i]:.2g} {curve.units[i]}".rstrip()
        for i, name in enumerate(curve.names)
        if name in shown
    ]
