"""NamedSamples: one signal of a Python session, from an array, a list, or a column of pandas, Polars or xarray."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.arrays import Floats
from livebode.core.errors import UsageError
from livebode.dataclass import dataclass

_MOMENTS = "mM"
_NANOSECONDS_PER_S = 1_000_000_000


@dataclass(frozen=True, eq=False)
class NamedSamples:
    """Samples of one signal, and what its object says about them.

    Attributes
    ----------
    values
        Shape (samples,); NaN where a sample is missing.
    name
        Its name with the unit, as a column has it: "torque [N m]"; empty without one.
    unit
        Unit in the attributes of an xarray object; empty without one.
    index
        Times of the samples, from an index or a coordinate: dates, durations or numbers; None without one.
    index_name
        Name of that index, with its unit.
    """

    values: Floats
    name: str = ""
    unit: str = ""
    index: NDArray[Any] | None = None
    index_name: str = ""

    @property
    def time(self) -> tuple[str, Floats] | None:
        """Name and values of the index; of dates and durations seconds from the first one."""
        if self.index is None or self.index.dtype.kind not in _MOMENTS:
            return None if self.index is None else (self.index_name, self.index)
        passed = (self.index - self.index[0]).astype("timedelta64[ns]").astype(np.int64)
        return "time [s]", passed / _NANOSECONDS_PER_S


def series_of(**signals: ArrayLike) -> dict[str, NamedSamples]:
    """The signals by their argument; all of one length.

    Parameters
    ----------
    **signals
        Anything that NumPy makes a series of real numbers from. One axis may be longer than 1, as of the columns in
        files of MATLAB.

    Raises
    ------
    UsageError
        If one is not a series of real numbers, or their lengths or times differ.

    Examples
    --------
    >>> series_of(u=[1, 2, 3], y=np.array([[1.0], [2.0], [4.0]]))["y"].values
    array([1., 2., 4.])
    >>> series_of(u=[1, 2, 3], y=[1, 2])
    Traceback (most recent call last):
    ...
    livebode.UsageError: u has 3 and y has 2 samples; give signals that were sampled together, value by value
    """
    found = {argument: _one(argument, data) for argument, data in signals.items()}
    counts = {argument: series.values.size for argument, series in found.items()}
    if len(set(counts.values())) > 1:
        *before, last = [f"{argument} has {count}" for argument, count in counts.items()]
        raise UsageError(
            "wrong-shape",
            f"{', '.join(before)} and {last} samples",
            "give signals that were sampled together, value by value",
            samples=counts,
        )
    indices = {argument: series.index for argument, series in found.items() if series.index is not None}
    for argument, index in indices.items():
        first, reference = next(iter(indices.items()))
        if not np.array_equal(index, reference):
            raise UsageError(
                "conflict",
                f"the indices of {first} and {argument} have different times",
                "align them first, in pandas with pd.concat([…], axis=1).dropna()",
                arguments=[first, argument],
            )
    return found


def _one(argument: str, data: Any) -> NamedSamples:
    values = _values(argument, data)
    index, index_name = _index(data)
    name = getattr(data, "name", None)
    attributes = getattr(data, "attrs", None)
    unit = attributes.get("units", "") if isinstance(attributes, Mapping) else ""
    return NamedSamples(values, name if isinstance(name, str) else "", str(unit), index, index_name)


def _values(argument: str, data: Any) -> Floats:
    if data is None:
        raise UsageError("missing", f"{argument} is None", "give the samples of the signal", argument=argument)
    if isinstance(data, np.ma.MaskedArray):
        data = np.ma.filled(data.astype(np.float64), np.nan)
    array = _array(argument, data)
    if array.dtype.kind == "c":
        raise UsageError(
            "unreadable",
            f"{argument} is complex",
            "give the samples of the signal over time, which are real: not its spectrum",
            argument=argument,
        )
    if array.dtype.kind not in "fiub":
        raise UsageError(
            "unreadable",
            f"{argument} has values of type {array.dtype}, not real numbers",
            "convert them to float",
            argument=argument,
        )
    if array.size == 0 or array.ndim == 0:
        many = "is empty" if array.size == 0 else f"is one number, {array[()]:g}"
        raise UsageError("wrong-shape", f"{argument} {many}", "give the samples of the signal", argument=argument)
    if array.size > max(array.shape):
        raise UsageError(
            "wrong-shape",
            f"{argument} has shape {array.shape}, which is not one signal",
            f"give one column, such as {argument}[:, 0]; several outputs as a list of them",
            argument=argument,
            shape=list(array.shape),
        )
    return np.ascontiguousarray(array.ravel(), dtype=np.float64)


def _array(argument: str, data: Any) -> np.ndarray[Any, np.dtype[Any]]:
    try:
        array = np.asarray(data)
        if array.dtype.kind != "O":
            return array
        # Columns of pandas with missing values, which NumPy would not convert.
        convert = getattr(data, "to_numpy", None)
        return np.asarray(convert(dtype=np.float64, na_value=np.nan) if convert else array.astype(np.float64))
    except (ValueError, TypeError) as error:
        raise UsageError(
            "unreadable",
            f"{argument} cannot be read as numbers: {str(error).splitlines()[0].rstrip('.')}",
            "give a series of real numbers",
            argument=argument,
        ) from None


def _index(data: Any) -> tuple[NDArray[Any] | None, str]:
    """Times of a column of pandas or an array of xarray, and the name of what has them; None without."""
    index: Any = getattr(data, "index", None)
    name = getattr(index, "name", None)
    dims: Any = getattr(data, "dims", ())
    if len(dims) == 1 and dims[0] in data.coords:
        index, name = data.coords[dims[0]], str(dims[0])
        name = f"{name} [{unit}]" if (unit := index.attrs.get("units")) else name
    if not hasattr(index, "dtype"):
        return None, ""
    if hasattr(index, "tz_convert") and index.tz is not None:
        index = index.tz_convert(None)
    values = np.asarray(index)
    if values.dtype.kind in _MOMENTS or (values.dtype.kind == "f" and isinstance(name, str)):
        return values, str(name)
    return None, ""  # numbers of rows, or something else
