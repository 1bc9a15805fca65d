"""The picture of a friction curve: measured friction over speed, and the fitted curve with its band."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from livebode.pictures import drawing, heading, new_figure, save, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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


def save_friction_picture(curves: FrictionCurves, path: Path, *, title: str = "", dark: bool = False) -> Path:
    """Write the picture."""
    return save(friction_figure(curves, title=title, dark=dark), path, style(dark))


def friction_figure(curves: FrictionCurves, *, title: str = "", dark: bool = False) -> Figure:
    """Friction over speed: dots are the smoothed input without inertia and constant force, the band covers 95 %.

    The dashed line is that of each direction. With places, Coulomb friction over the position is on the right.
    """
    look, curve, each = style(dark), curves.curve, curves.directions
    columns = 1 if curves.places is None else 2
    with drawing(look):
        figure = new_figure(7.2 + 4.6 * (columns - 1), 4.6)
        width, height = figure.get_size_inches()
        grid = figure.add_gridspec(
            1, columns, width_ratios=[1.5, 1.0][:columns], left=0.85 / width, right=0.985, top=1 - 1.0 / height,
            bottom=0.6 / height, wspace=0.22,
        )  # fmt: skip
        heading(figure, look, title or "Friction", _facts(curve), 0.85 / width)
        axes = figure.add_subplot(grid[0, 0])
        speed, friction = curve.measured[:, :: max(curve.measured.shape[1] // _DOTS, 1)]
        axes.plot(speed, friction, ".", color=look.muted, alpha=0.35, markersize=3, label="measured")
        for sign in (-1, 1):
            v = sign * np.linspace(max(curve.speed[0], 1e-3 * curve.speed[1]), curve.speed[1], _POINTS)
            value, bound = curve.at(v)
            axes.fill_between(v, value - bound, value + bound, color=look.run, alpha=0.25, linewidth=0)
            axes.plot(v, value, color=look.run, linewidth=1.8, label=_once("both directions, 95 %", sign))
            axes.plot(
                v,
                _with_offset(each, curve, v),
                "--",
                color=look.newest,
                linewidth=1.2,
                label=_once("each direction", sign),
            )
        axes.axhline(0.0, color=look.grid, linewidth=0.8, zorder=0)
        axes.axvline(0.0, color=look.grid, linewidth=0.8, zorder=0)
        axes.set_xlabel(labelled("speed", speed_unit(curve)))
        axes.set_ylabel(labelled("friction", curve.units[curve.index("coulomb")]))
        axes.legend(loc="upper left")
        if curves.places is not None:
            places = figure.add_subplot(grid[0, 1])
            indices = [curves.places.index(f"coulomb_{j + 1}") for j in range(curves.places.places.size)]
            places.errorbar(
                curves.places.places, curves.places.value[indices], curves.places.bound()[indices],
                color=look.run, marker="o", markersize=4, capsize=3, linewidth=1.4,
            )  # fmt: skip
            places.set_xlabel("position")
            places.set_ylabel(labelled("Coulomb friction", curve.units[curve.index("coulomb")]))
    return figure


def _once(label: str, sign: int) -> str:
    """The label for one of the two branches; Matplotlib omits one with an underscore from the legend."""
    return label if sign > 0 else f"_{label}"


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


def _facts(curve: FrictionCurve) -> str:
    bound = curve.bound()
    shown = {"coulomb": "Coulomb", "viscous": "viscous", "stribeck": "Stribeck", "inertia": "inertia"}
    return " · ".join(
        f"{shown[name]} {curve.value[i]:.4g} ± {bound[i]:.2g} {curve.units[i]}".rstrip()
        for i, name in enumerate(curve.names)
        if name in shown
    )
