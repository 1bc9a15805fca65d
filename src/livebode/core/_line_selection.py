"""Frequencies to positions among Lines: exact lines, and ranges. There is no interpolation."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.core.errors import GridError, UsageError
from livebode.core.lines import ON_GRID_BINS, Lines

_NAMED = 2  # nearest lines in a message


def position(lines: Lines, frequency_hz: ArrayLike) -> NDArray[np.intp]:
    """Positions of these frequencies among the lines, in the shape of `frequency_hz`; GridError for another one."""
    wanted = np.asarray(frequency_hz, dtype=np.float64)
    bins = wanted / lines.resolution_hz
    known = np.asarray(lines.bins)
    at = np.searchsorted(known, np.rint(bins)).clip(0, len(lines) - 1)
    off = ~(np.abs(known[at] - bins) < ON_GRID_BINS)
    if off.any():
        raise _not_measured(lines, float(wanted[off].flat[0]))
    return np.asarray(at)


def within(lines: Lines, span_hz: slice) -> NDArray[np.intp]:
    """Positions of the lines from `start` to `stop` in Hz, both included; None is an open end."""
    if span_hz.step is not None:
        raise UsageError(
            "out-of-range",
            f"a slice of frequencies has no step, and this one has {span_hz.step!r}",
            "give slice(from_hz, to_hz)",
            argument="frequency_hz",
            value=str(span_hz.step),
        )
    f = lines.frequency_hz
    room_hz = ON_GRID_BINS * lines.resolution_hz
    low = -np.inf if span_hz.start is None else float(span_hz.start)
    high = np.inf if span_hz.stop is None else float(span_hz.stop)
    at = np.flatnonzero((f >= low - room_hz) & (f <= high + room_hz))
    if not at.size:
        raise GridError(
            "band-without-line",
            f"no measured line is between {low:g} and {high:g} Hz",
            f"choose a range that overlaps {f[0]:g} … {f[-1]:g} Hz",
            band_hz=[low, high],
            lines_hz=[float(f[0]), float(f[-1])],
        )
    return at


def _not_measured(lines: Lines, frequency_hz: float) -> GridError:
    f = lines.frequency_hz
    nearest = sorted(f[np.argsort(np.abs(f - frequency_hz), kind="stable")[:_NAMED]].tolist())
    text = " and ".join(f"{one:g}" for one in nearest)
    return GridError(
        "line-off",
        f"{frequency_hz:g} Hz is not a measured line, and a measured response is not interpolated",
        f"choose a measured line; the nearest {'are' if len(nearest) > 1 else 'is'} {text} Hz",
        frequency_hz=frequency_hz,
        resolution_hz=lines.resolution_hz,
        nearest_hz=nearest,
    )
