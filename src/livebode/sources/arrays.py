"""Arrays of any shape as columns: which are channels, which are parameters, which are neither."""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from livebode.dataclass import dataclass
from livebode.sources.recording import COLUMNS_MAX, Column, Skipped, oversized
from livebode.sources.units import split_unit

WIDTH_MAX = 64
"""A matrix with more rows and more columns than this is not a set of channels."""
DEPTH_MAX = 32
"""A file whose parts are nested deeper is treated as damaged."""


@dataclass(frozen=True)
class Slot:
    """One series in an array: the array's name, its shape, which axis is time, and the index on each other axis."""

    array: str
    shape: tuple[int, ...]
    time_axis: int
    others: tuple[int, ...] = ()

    @property
    def samples(self) -> int:
        return self.shape[self.time_axis] if self.shape else 1

    def at(self, first: int, last: int) -> tuple[int | slice, ...]:
        """Index expression of samples `first` … `last` − 1.

        >>> Slot("y", (3, 100, 2), 1, (2, 0)).at(10, 20)
        (2, slice(10, 20, None), 0)
        """
        if not self.shape:
            return ()
        return (*self.others[: self.time_axis], slice(first, last), *self.others[self.time_axis :])

    def strides(self, *, fortran: bool) -> tuple[int, int]:
        """Number of its first value in the array as stored, and of values from one sample to the next.

        >>> Slot("y", (3, 100, 2), 1, (2, 1)).strides(fortran=False)
        (401, 2)
        """
        steps = [math.prod(self.shape[:at] if fortran else self.shape[at + 1 :]) for at in range(len(self.shape))]
        step = steps.pop(self.time_axis) if steps else 1
        return sum(index * size for index, size in zip(self.others, steps, strict=True)), step


def array_columns(
    array: str, shape: tuple[int, ...], dtype: np.dtype[np.generic], unit: str = "", tie_axis: int = 0
) -> tuple[list[Column], Skipped | None]:
    """The columns in the array called `array`, or the reason why there are none.

    An array has its time along the longest axis; where several are, a matrix along `tie_axis`. Its series are called
    name(1), name(2), … or name(1,2) by the index on each other axis, in reverse order with `tie_axis` 1, which is that
    of MATLAB's files in HDF5. If only one axis is longer than one, the series has no index. A unit in the array's name
    is taken where `unit` is empty.

    >>> columns, _ = array_columns("y", (1000, 2), np.dtype("f8"), "m")
    >>> [(c.name, c.unit, c.samples) for c in columns]
    [('y(1)', 'm', 1000), ('y(2)', 'm', 1000)]
    >>> columns, _ = array_columns("y", (2, 2, 1000), np.dtype("f8"))
    >>> [c.name for c in columns]
    ['y(1,1)', 'y(1,2)', 'y(2,1)', 'y(2,2)']
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
        slot = Slot(array, shape, time_axis, (0,) * (len(shape) - 1))
        return [Column(name, unit, math.prod(shape), aliases, key=slot)], None
    longest = [axis for axis, length in enumerate(shape) if length == max(shape)]
    time_axis = longest[-1] if (len(shape) == 2) == (tie_axis == 1) else longest[0]
    widths = [length for axis, length in enumerate(shape) if axis != time_axis]
    if math.prod(widths) > WIDTH_MAX:
        return [], Skipped(array, f"its shape {shape} is neither a series nor at most {WIDTH_MAX} series side by side")
    columns = []
    for others in product(*map(range, widths)):
        index = f"({','.join(str(at + 1) for at in (reversed(others) if tie_axis else others))})"
        named = tuple(f"{alias}{index}" for alias in aliases)
        slot = Slot(array, shape, time_axis, others)
        columns.append(Column(f"{name}{index}", unit, shape[time_axis], named, key=slot))
    return columns, None


def check_nesting(name: str, depth: int, parts: int) -> None:
    """RecordingError at a part that is nested too deep, or one too many of those visited."""
    if depth > DEPTH_MAX or parts > COLUMNS_MAX:
        raise oversized(
            f"the file is nested deeper than {DEPTH_MAX} levels or has more than {COLUMNS_MAX} parts at {name!r}",
            COLUMNS_MAX,
            part=name,
        )
