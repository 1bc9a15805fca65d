"""HeldChunks: what was read of a short recording, so that a run reads its file once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from livebode.sources.recording import Chunk, Column

VALUES_MAX = 1 << 19
"""Values that are held at most: 4 MB in double precision."""


class HeldChunks:
    """The values of the columns that were last read to the end, if they are few.

    A run reads a recording several times: to find its roles and lines, to examine it as a whole, and to track it.
    """

    def __init__(self) -> None:
        self._columns: Sequence[Column] = ()
        self._chunks: list[Chunk] = []

    def chunks(self, columns: Sequence[Column], read: Callable[[], Iterator[Chunk]]) -> Iterator[Chunk]:
        """The values of `columns` in chunks, from memory or else by `read`."""
        known = [id(column) for column in self._columns]
        if {id(column) for column in columns} <= set(known):
            places = [known.index(id(column)) for column in columns]
            yield from ([chunk[place] for place in places] for chunk in self._chunks)
            return
        chunks: list[Chunk] = []
        values = 0
        for chunk in read():
            values += len(chunk) * len(chunk[0])
            if values <= VALUES_MAX:
                chunks.append(chunk)
            else:
                chunks.clear()
            yield chunk
        if chunks:
            self._columns, self._chunks = columns, chunks
