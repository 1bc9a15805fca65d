"""Checks of a specification: numbers out of range, and settings that exclude each other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from livebode.core import UsageError
from livebode.excitation import check_order

if TYPE_CHECKING:
    from livebode.experiment_design.wish import Wish

_WHOSE = {"order": "prbs", "held_ticks": "prbs", "sweep": "chirp", "periods": "stepped"}
_RESOLUTION_MIN_HZ = 1e-6
_STEP_MIN = 1e-12
_MAINS_MIN_HZ = 1.0
_ACCURACY_MIN, _AMPLITUDE_MIN, _AMPLITUDE_MAX = 1e-6, 1e-9, 1e9  # values outside are typing errors


def check(wish: Wish) -> None:
    """Raise UsageError for a value that is missing, out of range, of another kind, or given twice."""
    _check_numbers(wish)
    _check_amplitude(wish)
    for error in (*_of_another_kind(wish), *_amplitudes_twice(wish)):
        raise error
    _check_band(wish)
    _check_distance(wish)
    if not all(np.isfinite(mains) and mains >= _MAINS_MIN_HZ for mains in wish.mains_hz):
        raise _out_of_range(
            "mains_hz", list(wish.mains_hz), "a list of frequencies above 1 Hz", "write for example [50, 60]"
        )


def _out_of_range(name: str, value: object, what: str, remedy: str, **facts: float) -> UsageError:
    return UsageError("out-of-range", f"{name}={value} is not {what}", remedy, argument=name, value=value, **facts)


def _conflict(wish: Wish, name: str, message: str, remedy: str) -> UsageError:
    return UsageError("conflict", message, remedy, argument=name, kind=wish.kind)


def _check_numbers(wish: Wish) -> None:
    for name in ("resolution_hz", "accuracy", "crest_factor_max", "resolution_n_m"):
        value = getattr(wish, name)
        if value is not None and not (np.isfinite(value) and value > 0):
            raise _out_of_range(name, value, "a finite number above 0", "choose a number above 0")
    for name, low, remedy in (
        ("resolution_hz", _RESOLUTION_MIN_HZ, "choose a coarser one"),
        ("resolution_n_m", _STEP_MIN, "leave it out for no rounding"),
        ("crest_factor_max", 1, "allow more: a PRBS has 1"),
        ("window", 1, "give a whole number above 0"),
        ("held_ticks", 1, "give a whole number above 0"),
        ("periods", 1, "give a whole number above 0"),
        ("seed", 0, "give a whole number of at least 0"),
    ):
        value = getattr(wish, name)
        if value is not None and value < low:
            raise _out_of_range(name, value, f"at least {low:g}", remedy, low=low)
    if not _ACCURACY_MIN <= wish.accuracy <= 1:
        remedy = "give it as a fraction of |G|, such as 0.05 for 5 %"
        raise _out_of_range(
            "accuracy", wish.accuracy, f"from {_ACCURACY_MIN:g} to 1", remedy, low=_ACCURACY_MIN, high=1
        )


def _check_amplitude(wish: Wish) -> None:
    given = np.atleast_1d(np.asarray(1.0 if wish.amplitude_n_m is None else wish.amplitude_n_m, dtype=np.float64))
    low, high, remedy = _AMPLITUDE_MIN, _AMPLITUDE_MAX, "leave it out to have it chosen"
    whole = np.all(np.isfinite(given)) and not np.any(given < 0) and given.any()
    if not (whole and low <= given.max() <= high):
        raise _out_of_range(
            "amplitude_n_m", wish.amplitude_n_m, f"finite and from {low:g} to {high:g} N m", remedy, low=low, high=high
        )


def _of_another_kind(wish: Wish) -> Iterator[UsageError]:
    kind = wish.kind
    for name, whose in _WHOSE.items():
        if getattr(wish, name) is not None and kind != whose:
            yield _conflict(wish, name, f"{name} belongs to kind {whose!r}, and kind is {kind!r}", "leave it out")
    if wish.phases is not None and kind not in ("multisine", "odd"):
        message = f"phases belong to several lines at once, and kind is {kind!r}"
        yield _conflict(wish, "phases", message, "leave them out")
    if wish.lines is not None and kind not in ("multisine", "stepped"):
        remedy = "give band_hz instead of lines, or take a multisine"
        yield _conflict(wish, "lines", f"{kind!r} has its own lines", remedy)
    if wish.shape != "flat" and kind not in ("multisine", "odd", "stepped"):
        message, remedy = f"the lines of {kind!r} cannot be shaped", "leave out shape, or take a multisine"
        yield _conflict(wish, "shape", message, remedy)


def _amplitudes_twice(wish: Wish) -> Iterator[UsageError]:
    if wish.listed and wish.shape != "flat":
        message = f"amplitude_n_m lists amplitudes, which shape = {wish.shape!r} would set"
        yield _conflict(wish, "shape", message, "leave one out")
    if wish.listed and wish.kind in ("prbs", "chirp"):
        message = f"amplitude_n_m lists {len(wish.listed)} amplitudes, but {wish.kind!r} has one"
        yield _conflict(wish, "amplitude_n_m", message, "give one amplitude")


def _check_band(wish: Wish) -> None:
    if wish.band_hz is not None and np.shape(wish.band_hz) != (2,):
        remedy = "give two frequencies in Hz, such as [20, 140]"
        raise UsageError("wrong-shape", f"band_hz={wish.band_hz} is not a band", remedy, argument="band_hz")
    if wish.order is not None:
        check_order(wish.order)
    if wish.lines is None and wish.band_hz is None:
        remedy = "give the band to measure, such as [20, 140] Hz"
        raise UsageError("missing", "neither band_hz nor lines is given", remedy, argument="band_hz")


def _check_distance(wish: Wish) -> None:
    """Check that exactly one setting determines the distance of the lines."""
    if wish.kind == "prbs" and wish.window is not None:
        message = f"a PRBS has 2^order - 1 bits, not a window of {wish.window}"
        raise _conflict(wish, "window", message, "give order or resolution_hz instead")
    names = ("resolution_hz", "window", "order") if wish.lines is None else ("lines", "band_hz", "resolution_hz")
    given = [name for name in names if getattr(wish, name) is not None]
    if not given:
        other = "order" if wish.kind == "prbs" else "window"
        message, remedy = f"neither resolution_hz nor {other} is given", "give the distance of the lines, resolution_hz"
        raise UsageError("missing", message, remedy, argument="resolution_hz")
    if len(given) > 1:
        raise _conflict(wish, given[1], f"{given[0]} and {given[1]} both determine the lines", "leave one out")
