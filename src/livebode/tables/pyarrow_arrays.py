"""NumPy arrays as Arrow arrays and back, by their buffers.

Arrow's own `pa.array` and `to_numpy` first check for values of pandas, and import it where it is installed, which
costs 0.4 s at the start of every run without a benefit.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import ArrayLike, NDArray


def from_numpy(values: ArrayLike) -> pa.Array[Any]:
    """Numbers or truth values of shape (rows,) as an Arrow array without nulls; contiguous numbers are not copied.

    >>> from_numpy(np.array([True, False, True])).to_pylist(), from_numpy(np.arange(4.0)[::2]).to_pylist()
    ([True, False, True], [0.0, 2.0])
    """
    values = np.ascontiguousarray(values)
    data = np.packbits(values, bitorder="little") if values.dtype == np.bool_ else values
    return pa.Array.from_buffers(pa.from_numpy_dtype(values.dtype), len(values), [None, pa.py_buffer(data)])


def text(words: Sequence[str], at: NDArray[np.integer[Any]] | None = None) -> pa.Array[Any]:
    """The word number `at[i]` in row i, or all words in order, as an Arrow array of strings.

    >>> text(["Keff", "mL"], np.array([1, 0, 1])).to_pylist()
    ['mL', 'Keff', 'mL']
    """
    letters = [word.encode() for word in words]
    ends = np.cumsum([0, *map(len, letters)], dtype=np.int32)
    buffers = [None, pa.py_buffer(ends), pa.py_buffer(b"".join(letters))]
    every = pa.Array.from_buffers(pa.string(), len(letters), buffers)
    return every if at is None else every.take(from_numpy(at))


def to_numpy(array: pa.Array[Any]) -> NDArray[Any]:
    """Values of an Arrow array of numbers or truth values; numbers without nulls are not copied.

    A null becomes NaN, and integers in the same array doubles; among truth values it is False.

    >>> to_numpy(pa.array([1, None], pa.int64()))
    array([ 1., nan])
    """
    if not len(array):
        return np.empty(0, dtype=array.type.to_pandas_dtype())
    if pa.types.is_boolean(array.type):
        return np.asarray(to_numpy(array.cast(pa.uint8())) == 1)
    if not array.null_count:
        return np.from_dlpack(array)
    known = pa.Array.from_buffers(array.type, len(array), [None, array.buffers()[1]], offset=array.offset)
    valid = np.from_dlpack(array.is_valid().cast(pa.uint8())).view(np.bool_)
    return np.where(valid, np.from_dlpack(known), np.nan)
