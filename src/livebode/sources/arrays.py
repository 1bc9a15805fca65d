"""Arrays of any shape as columns: which are channels, which are parameters, which are neither."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from livebode.sources.recording import Column, Skipped
from livebode.sources.units import split_unit

WIDTH_MAX = 64
"""A matrix with more rows and more columns than this is not a set of channels."""


@dataclass(frozen=True)
class Slot:
    """One series in an array: the array's name, its shape, which axis is time, and the index on the other axis."""

    array: str
    shape: tuple[int, ...]
    time_axis: int
    index: int

    @property
    def samples(self) -> int:
        return self.shape[self.time_axis] if self.shape else 1

    def at(self, first: int, last: int) -> tuple[int | slice, ...]:
        """Index expression of samples `first` … `last` − 1.

        >>> Slot("y", (3, 100), 1, 2).at(10, 20)
        (2, slice(10, 20, None))
        """
        place: list[int | slice] = [0] * len(self.shape)
        if len(self.shape) == 2:
            place[1 - self.time_axis] = self.index
        place[self.time_axis] = slice(first, last)
        return tuple(place)


def array_columns(
    array: str, shape: tuple[int, ...], dtype: np.dtype[np.generic], unit: str = "", tie_axis: int = 0
) -> tuple[list[Column], Skipped | None]:
    """The columns in the array called `array`, or the reason why there are none.

    Axes of length one do not count. A matrix has its time along the longer axis (`tie_axis` where both are equal) and
    its columns are called name(1), name(2), … A unit in the array's name is taken where `unit` is empty.

    >>> columns, _ = array_columns("y", (1000, 2), np.dtype("f8"), "m")
    >>> [(c.name, c.unit, c.samples) for c in columns]
    [('y(1)', 'm', 1000), ('y(2)', 'm', 1000)]
    """
    if dtype.kind not in "fiub":
        return [], Skipped(array, f"its values are of type {dtype}, not real numbers")
    if any(length == 0 for length in shape):
        return [], Skipped(array, "it is empty")
    name, unit = (array, unit) if unit else split_unit(array)
    aliases = () if name == array else (array,)
    long = [axis for axis, length in enumerate(shape) if length > 1]
    if len(long) <= 1:
        time_axis = long[0] if long else 0
        slot = Slot(array, shape, time_axis, 0)
        return [Column(name, unit, math.prod(shape), aliases, key=slot)], None
    if len(shape) != 2 or min(shape) > WIDTH_MAX:
        return [], Skipped(array, f"its shape {shape} is neither a series nor at most {WIDTH_MAX} series side by side")
    time_axis = tie_axis if shape[0] == shape[1] else int(shape[1] > shape[0])
    return [
        Column(
            f"{name}({index + 1})",
            unit,
            shape[time_axis],
            tuple(f"{alias}({index + 1})" for alias in aliases),
            key=Slot(array, shape, time_axis, index),
        )
        for index in range(shape[1 - time_axis])
    ], None
