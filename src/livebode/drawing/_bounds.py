"""Bounds as regions of the complex plane, and limits of axes that bounds do not stretch."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.drawing._curves import FLOOR_DB, decibels

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_CORNERS = 72
_REACH = 0.35  # of the range of the values: as far as bounds move the limits


def circles(value: Complex, radius: Floats) -> list[Floats]:
    """Each circle as a polygon of (real, imaginary), (corners, 2)."""
    turn = np.exp(2j * np.pi * np.arange(_CORNERS) / _CORNERS)
    return [np.column_stack([corners.real, corners.imag]) for corners in value[:, None] + radius[:, None] * turn]


def nichols_regions(value: Complex, radius: Floats, phase_deg: Floats) -> list[Floats]:
    """The image of each circle as a polygon of (degrees, dB), (corners, 2), around its `phase_deg`.

    A circle that contains the origin has every phase, and reaches down to `FLOOR_DB`.
    """
    turn = np.exp(2j * np.pi * np.arange(_CORNERS) / _CORNERS)
    regions = []
    for one, reach, deg in zip(value, radius, phase_deg):
        if reach < abs(one):
            around = 1 + reach / abs(one) * turn
            regions.append(np.column_stack([deg + np.degrees(np.angle(around)), decibels(one * around)]))
            continue
        away = np.linspace(-np.pi, np.pi, _CORNERS)
        far = abs(one) * np.cos(away) + np.sqrt(reach**2 - (abs(one) * np.sin(away)) ** 2)
        top = np.column_stack([deg + np.degrees(away), np.maximum(decibels(far), FLOOR_DB)])
        regions.append(np.concatenate([top, [[deg + 180, FLOOR_DB], [deg - 180, FLOOR_DB]]]))
    return regions


@contextmanager
def without_stretching(axes: Axes, *, same_scale: bool = False) -> Iterator[None]:
    """What is drawn within moves the limits by a third of the present range at most: a wide bound hides no curve.

    With `same_scale` the larger of the two ranges counts for both.
    """
    before = axes.dataLim.frozen()
    yield
    after = axes.dataLim.frozen()
    size = np.asarray(before.size)
    room = _REACH * (size.max() if same_scale else size)
    axes.dataLim.set_points(
        np.array([np.maximum(after.min, before.min - room), np.minimum(after.max, before.max + room)])
    )
    axes.autoscale_view()
