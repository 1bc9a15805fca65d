"""RowArrays: arrays with one row for each time or item, which are joined, indexed and compared together."""

from __future__ import annotations

from collections.abc import Sequence
from inspect import get_annotations
from operator import attrgetter
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from livebode.core.errors import UsageError


class RowArrays:
    """Base of frozen dataclasses whose fields are arrays with rows as their first axis.

    Brackets with a slice, or with an array of numbers or of truth values, give some of the rows, and `join` several
    parts as one. A subclass names the fields that all rows share in `_SHARED`.

    Examples
    --------
    >>> import livebode
    >>> responses = livebode.example_responses()
    >>> parts = responses[:10], responses[10:]
    >>> len(parts[0]), livebode.Responses.join(parts).equals(responses)
    (10, True)
    """

    _SHARED: ClassVar[tuple[str, ...]] = ()
    _ARRAYS: ClassVar[tuple[str, ...]] = ()

    def __init_subclass__(cls) -> None:
        cls._ARRAYS = (*cls._ARRAYS, *(name for name in get_annotations(cls) if name not in cls._SHARED))

    def __len__(self) -> int:
        return len(getattr(self, self._ARRAYS[0]))

    def __getitem__(self, rows: slice | NDArray[Any]) -> Self:
        kind = type(self)
        arrays = {name: getattr(self, name)[rows] for name in kind._ARRAYS}
        return kind(**arrays, **{name: getattr(self, name) for name in kind._SHARED})

    def equals(self, other: Self) -> bool:
        """Whether all values are the same; NaN equals NaN."""
        shared = all(getattr(self, name) == getattr(other, name) for name in self._SHARED)
        pairs = ((getattr(self, name), getattr(other, name)) for name in self._ARRAYS)
        return shared and all(np.array_equal(own, others, equal_nan=own.dtype.kind in "fc") for own, others in pairs)

    @classmethod
    def join(cls, parts: Sequence[Self]) -> Self:
        """Copy parts of one run into one, in order.

        Raises
        ------
        UsageError
            If there is no part.
        LivebodeError
            If the parts differ in what all rows share.
        """
        if not parts:
            raise UsageError(
                "missing", f"there are no {cls.__name__.lower()} to join", "give at least one part", argument="parts"
            )
        first = parts[0]
        if cls._SHARED:
            shared = attrgetter(*cls._SHARED)
            expected = shared(first)
            if any(shared(part) != expected for part in parts):
                raise cls._not_alike(parts)
        rows = {name: np.concatenate([getattr(part, name) for part in parts]) for name in cls._ARRAYS}
        return cls(**rows, **{name: getattr(first, name) for name in cls._SHARED})

    @classmethod
    def _not_alike(cls, parts: Sequence[Self]) -> Exception:
        """The error for parts that differ in what all rows share."""
        raise NotImplementedError
