"""Damage of a file of a directory, as a disk or a power cut does it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np

_BLOCK_BYTES = 64


def _flipped(content: bytearray, rng: np.random.Generator) -> None:
    content[rng.integers(len(content))] ^= 1 << int(rng.integers(8))


def _cut(content: bytearray, rng: np.random.Generator) -> None:
    del content[rng.integers(len(content)) :]


def _zeroed(content: bytearray, rng: np.random.Generator) -> None:
    at = int(rng.integers(len(content)))
    content[at : at + _BLOCK_BYTES] = bytes(len(content[at : at + _BLOCK_BYTES]))


def _end_zeroed(content: bytearray, rng: np.random.Generator) -> None:
    at = int(rng.integers(len(content)))
    content[at:] = bytes(len(content) - at)


KINDS: Final[dict[str, Callable[[bytearray, np.random.Generator], None]]] = {
    "bit": _flipped,
    "cut": _cut,
    "zeros": _zeroed,
    "end": _end_zeroed,
}
"""One flipped bit, the end cut off, 64 zeros, and zeros up to the end, as a power cut leaves them."""


def damaged(content: bytes, rng: np.random.Generator, kind: str) -> bytes:
    """Other bytes."""
    changed = bytearray(content)
    while changed == content:
        KINDS[kind](changed, rng)
    return bytes(changed)


def damage(folder: Path, rng: np.random.Generator, kind: str) -> str:
    """Damage a random file; its name. Small files are as likely as large ones."""
    files = sorted(path for path in folder.rglob("*") if path.is_file() and path.stat().st_size)
    file = files[rng.integers(len(files))]
    file.write_bytes(damaged(file.read_bytes(), rng, kind))
    return file.relative_to(folder).as_posix()
