"""A column of text: few words that repeat, and their numbers in the rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Text:
    """The word number `at[i]` in row i.

    Attributes
    ----------
    words
        Different words; some may be in no row.
    at
        Numbers of words, int32, shape (rows,).
    """

    words: tuple[str, ...]
    at: NDArray[np.int32]

    @classmethod
    def of(cls, words: Sequence[str], at: NDArray[np.integer[Any]] | None = None) -> Text:
        """The word number `at[i]` in row i, or all words in order; they may repeat.

        >>> Text.of(["Hz", "kg", "Hz"]).words, Text.of(["Hz", "kg", "Hz"], np.array([2, 1])).to_list()
        (('Hz', 'kg'), ['Hz', 'kg'])
        """
        numbers: dict[str, int] = {}
        unique = np.array([numbers.setdefault(word, len(numbers)) for word in words], dtype=np.int32)
        return cls(tuple(numbers), unique if at is None else unique[at])

    @classmethod
    def join(cls, parts: Sequence[Text]) -> Text:
        """The rows of all parts, one after the other."""
        numbers: dict[str, int] = {}
        rows = []
        for part in parts:
            new = np.array([numbers.setdefault(word, len(numbers)) for word in part.words], dtype=np.int32)
            rows.append(new[part.at])
        return cls(tuple(numbers), np.concatenate(rows) if rows else np.empty(0, np.int32))

    def to_list(self) -> list[str]:
        return [self.words[number] for number in self.at.tolist()]

    def where(self, word: str) -> NDArray[np.bool_]:
        """Whether each row has this word."""
        found: NDArray[np.bool_] = self.at == (self.words.index(word) if word in self.words else -1)
        return found

    def __len__(self) -> int:
        return len(self.at)

    def __iter__(self) -> Iterator[str]:
        return iter(self.to_list())

    @overload
    def __getitem__(self, rows: int) -> str: ...
    @overload
    def __getitem__(self, rows: slice | NDArray[Any]) -> Text: ...
    def __getitem__(self, rows: int | slice | NDArray[Any]) -> str | Text:
        if isinstance(rows, int):
            return self.words[int(self.at[rows])]
        return Text(self.words, self.at[rows])

    def __eq__(self, other: object) -> bool:
        """Whether the rows are equal."""
        return isinstance(other, Text) and self.to_list() == other.to_list()

    __hash__ = None  # type: ignore[assignment]
