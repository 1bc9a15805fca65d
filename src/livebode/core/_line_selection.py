"""Frequencies to positions among Lines: exact lines, and ranges. There is no interpolation."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.core.errors import GridError, UsageError
from livebode.core.lines import ON_GRID_BINS, Lines

_NAMED = 2  # nearest lines in a message


def position(lines: Lines, frequency_hz: ArrayLike) -> NDArray[np.intp]:
    """Positions of these frequencies among the lines, in the shape of `frequency_hz`; GridError for another one."""
    required = np.asarray(frequency_hz, dtype=np.float64)
    bins = required / lines.resolution_hz
    known = np.asarray(lines.bins)
    at = np.searchsorted(known, np.rint(bins)).clip(0, len(lines) - 1)
    off = ~(np.abs(known[at] - bins) < ON_GRID_BINS)
    if off.any():
        raise _not_measured(lines, float(required[off].flat[0]))
    return np.asarray(at)


def within(lines: Lines, span_hz: slice) -> NDArray[np.intp]:
    """Positions of the lines from `start` to `stop` in Hz, both included; None is an open end."""
    f = lines.frequency_hz
    room_hz = ON_GRID_BINS * lines.resolution_hz
    low, high = ends(span_hz, "frequency_hz")
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


def ends(span: slice, argument: str) -> tuple[float, float]:
    """Both ends of a slice by value; TypeError for anything else, UsageError for a slice with a step."""
    if not isinstance(span, slice):
        raise TypeError(f"{argument}={span!r} is not a slice(from, to)")
    if span.step is not None:
        raise UsageError(
            "out-of-range",
            f"{argument} is a slice with a step, {span.step!r}, and selects by value",
            "give slice(from, to)",
            argument=argument,
            value=str(span.step),
        )
    return -np.inf if span.start is None else float(span.start), np.inf if span.stop is None else float(span.stop)


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
