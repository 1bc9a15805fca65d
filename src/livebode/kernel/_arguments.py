"""Checks and conversions of the arguments of a SlidingDFT that the fast path in C leaves to Python."""

import operator
from collections.abc import Iterable
from typing import Any, Final

import numpy as np
import numpy.typing as npt

VARIANTS: Final = ("modulated", "plain", "damped", "hann", "hamming", "blackman")
WINDOW_MAX: Final = 2**24
CHANNELS_MAX: Final = 1024
HOP_MAX: Final = 2**63 - 1

Array = npt.NDArray[Any]


def _integer(value: object) -> int | None:
    """The value as an int, or None if it is not an exact integer (bools are not)."""
    if isinstance(value, (bool, np.bool)):
        return None
    try:
        return operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        return int(value) if isinstance(value, (float, np.floating)) and value.is_integer() else None


def as_window(window: object) -> int:
    size = _integer(window)
    if size is None or not 1 <= size <= WINDOW_MAX:
        raise ValueError(f"{window=} is not an integer from 1 to {WINDOW_MAX} (samples)")
    return size


def as_channels(channels: object) -> int:
    number = _integer(channels)
    if number is None or not 1 <= number <= CHANNELS_MAX:
        raise ValueError(f"{channels=} is not an integer from 1 to {CHANNELS_MAX}")
    return number


def as_bins(bins: object, window: int) -> npt.NDArray[np.int64]:
    """Different integers 0 ≤ k < window, in the order given."""
    if isinstance(bins, (str, bytes)) or not isinstance(bins, Iterable):
        raise ValueError(f"{bins=} is not a sequence of integers, such as [2, 4, 6]")
    values = [_integer(k) for k in bins]
    if not values:
        raise ValueError(f"{bins=} is empty: give at least one bin")
    for given, k in zip(bins, values):
        if k is None or not 0 <= k < window:
            raise ValueError(f"bin {given!r} is not an integer from 0 to {window - 1}, as {window=} has")
    if len(set(values)) != len(values):
        twice = next(k for i, k in enumerate(values) if k in values[:i])
        raise ValueError(f"bin {twice} is duplicated: give each bin once")
    result = np.array(values, np.int64)
    result.flags.writeable = False
    return result


def as_dtype(dtype: npt.DTypeLike) -> np.dtype[Any]:
    try:
        kind = np.dtype(dtype)
    except TypeError:
        kind = np.dtype(object)
    if kind not in (np.dtype(np.float32), np.dtype(np.float64)):
        raise ValueError(f"{dtype=} is neither float32 nor float64")
    return kind


def as_variant(variant: object) -> int:
    if variant not in VARIANTS:
        raise ValueError(f"{variant=} is not one of {', '.join(VARIANTS)}")
    return VARIANTS.index(variant)


def as_damping(damping: object, variant: str) -> float:
    if damping is None:
        return 0.9999
    if variant != "damped":
        raise ValueError(f"{damping=} is for variant='damped' only; leave it out")
    if not isinstance(damping, (int, float, np.number)) or not 0 < float(damping) < 1:
        raise ValueError(f"{damping=} is not a number between 0 and 1")
    return float(damping)


def as_hop(hop: object) -> int:
    step = _integer(hop)
    if step is None or step < 1:
        raise ValueError(f"{hop=} is not an integer ≥ 1")
    if step > HOP_MAX:
        raise ValueError(f"hop is larger than {HOP_MAX} samples; give a smaller one")
    return step


def as_own_hop(hop: object, window: int, variant: str) -> int:
    """The hop of a SlidingDFT whose rows are at its multiples only; 0 for None."""
    if hop is None:
        return 0
    step = as_hop(hop)
    if window % step:
        raise ValueError(f"{hop=} does not divide {window=}: give a divisor, or leave it out")
    if variant != "modulated":
        raise ValueError(f"{hop=} is for variant='modulated' only; leave it out")
    return step


def refuse_phase(phase: object) -> None:
    raise ValueError(f"{phase=} is neither 'window' nor 'fixed'")


def _real(is_double: bool) -> type[np.floating[Any]]:
    return np.float64 if is_double else np.float32


def _complex(is_double: bool) -> type[np.complexfloating[Any, Any]]:
    return np.complex128 if is_double else np.complex64


def _as_real(x: object, is_double: bool) -> Array:
    try:
        array = np.asarray(x)
    except ValueError as error:
        raise ValueError("x has rows of different lengths: give as many samples to every channel") from error
    if array.dtype.kind not in "fiub":
        raise ValueError(f"x has dtype {array.dtype}, which is not real: give real numbers")
    with np.errstate(over="ignore"):
        return np.require(array, _real(is_double), ["ALIGNED"])


def as_sample(x: object, channels: int, is_double: bool) -> Array:
    """One sample of every channel, contiguous."""
    array = _as_real(x, is_double)
    if array.shape != (channels,) and not (channels == 1 and array.ndim == 0):
        want = "a number" if channels == 1 else f"{channels} numbers, one a channel"
        raise ValueError(f"a sample of shape {array.shape} was pushed; give {want}")
    return np.ascontiguousarray(array)


def as_samples(x: object, channels: int, is_double: bool) -> Array:
    """Samples of every channel; only rows and columns may be strided."""
    array = _as_real(x, is_double)
    if (array.ndim == 2 and array.shape[0] == channels) or (array.ndim == 1 and channels == 1):
        return array
    want = "(samples,) or (1, samples)" if channels == 1 else f"({channels}, samples)"
    turned = ": transpose it" if array.ndim == 2 and array.shape[1] == channels else ""
    raise ValueError(f"x has shape {array.shape} where {want} is needed{turned}")


def _rows_shape(channels: int, rows: int, bins: int, flat: bool) -> tuple[int, ...]:
    return (rows, bins) if flat else (channels, rows, bins)


def empty_rows(channels: int, rows: int, bins: int, flat: bool, is_double: bool) -> Array:
    return np.empty(_rows_shape(channels, rows, bins, flat), _complex(is_double))


def empty_spectrum(bins: int, channels: int, is_double: bool) -> Array:
    return np.empty((bins,) if channels == 1 else (channels, bins), _complex(is_double))


def refuse_out(out: object, channels: int, rows: int, bins: int, flat: bool, is_double: bool) -> None:
    shape, dtype = _rows_shape(channels, rows, bins, flat), np.dtype(_complex(is_double))
    want = f"out must be a writable C-contiguous {dtype} array of shape {shape}, apart from x"
    if not isinstance(out, np.ndarray):
        raise ValueError(f"{want}; it is a {type(out).__name__}")
    if out.shape != shape or out.dtype != dtype:
        raise ValueError(f"{want}; it is {out.dtype} of shape {out.shape}")
    if not (out.flags.c_contiguous and out.flags.writeable and out.flags.aligned):
        raise ValueError(f"{want}; it is not contiguous, not aligned or not writable")
    raise ValueError(f"{want}; it shares memory with x")
