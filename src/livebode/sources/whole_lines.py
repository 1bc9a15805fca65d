"""A stream of text in pieces of whole lines."""

from __future__ import annotations

from collections.abc import Iterator
from typing import IO


def whole_lines(file: IO[bytes], piece_bytes: int) -> Iterator[bytes]:
    r"""About `piece_bytes` at a time, as they are read; a line that is longer, or that has no end, may end anywhere.

    Lines end with ``\n``, ``\r\n`` or ``\r``. A piece may begin with the ``\n`` of the line before it.

    >>> import io
    >>> list(whole_lines(io.BytesIO(b"1\n22\n333\n4"), 4))
    [b'1\n', b'22\n', b'333\n', b'4']
    """
    rest = b""
    while piece := file.read(piece_bytes):
        end = max(piece.rfind(b"\n"), piece.rfind(b"\r")) + 1
        if end or len(rest) >= piece_bytes:
            yield rest + piece[:end]
            rest = piece[end:]
        else:
            rest += piece
    if rest:
        yield rest
