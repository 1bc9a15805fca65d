"""How a process allocates memory: fast for one tracker, and little for each of many axes."""

from __future__ import annotations

import ctypes
import os
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

_M_MMAP_THRESHOLD, _M_ARENA_MAX = -3, -8  # of glibc's malloc.h
_ARENAS = 1
_OWN_BYTES = 1 << 16
_INTERVAL_S = 20.0


def share_between_threads() -> None:
    """Let all threads take their memory from the same few places; to be called before the threads are started.

    glibc gives each thread an arena of its own, up to eight for each core, and Arrow's own allocator a heap: what one
    thread has freed is then not used by the others. Each axis has several threads. Arrays from 64 KB on are pages of
    their own, which the system has again when they are freed; with glibc's threshold, which grows to 32 MB, they leave
    holes among what is retained.
    """
    _let_arrow_share()
    if (mallopt := _glibc("mallopt")) is not None:
        mallopt(_M_ARENA_MAX, _ARENAS)
        mallopt(_M_MMAP_THRESHOLD, _OWN_BYTES)


def keep_freed_memory() -> None:
    """Let glibc retain the memory of freed arrays, where `share_between_threads` gave it no threshold; once for a run.

    It returns them to the system, and requests them again page by page for the next block: a third of the tracker's
    time. After an array of this size was freed, it retains the memory of smaller ones.
    """
    np.empty(31 << 20, dtype=np.uint8)


class FreeMemory:
    """Gives the free pages between what is retained back to the system, three times a minute; only with glibc.

    It takes 0.1 ms for each axis, in which no other thread allocates; what threads need again costs as much.
    """

    def __init__(self) -> None:
        self._trim = _glibc("malloc_trim")
        self._given_s = time.monotonic()

    def give_back(self) -> None:
        """Give it back if it is time."""
        if self._trim is not None and time.monotonic() - self._given_s >= _INTERVAL_S:
            self._trim(0)
            self._given_s = time.monotonic()


def _let_arrow_share() -> None:
    """PyArrow takes its memory from the system's allocator: now if it is loaded, otherwise when it will be."""
    if (arrow := sys.modules.get("pyarrow")) is None:
        os.environ["ARROW_DEFAULT_MEMORY_POOL"] = "system"
    else:
        arrow.set_memory_pool(arrow.system_memory_pool())


def _glibc(name: str) -> Callable[..., Any] | None:
    """A function of glibc; None with other C libraries, which have no arenas."""
    return getattr(ctypes.CDLL(None), name, None) if sys.platform == "linux" else None
