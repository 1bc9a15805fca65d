"""How a process with many threads allocates memory, so that an axis takes little of it."""

from __future__ import annotations

import ctypes
import sys

import pyarrow as pa

_M_ARENA_MAX = -8  # of glibc's malloc.h
_ARENAS = 1


def share_between_threads() -> None:
    """Let all threads take their memory from the same few places; to be called before the threads are started.

    glibc gives each thread an arena of its own, up to eight for each core, and Arrow's own allocator a heap: what one
    thread has freed is then not used by the others. Each axis has several threads.
    """
    pa.set_memory_pool(pa.system_memory_pool())
    if sys.platform == "linux":
        mallopt = getattr(ctypes.CDLL(None), "mallopt", None)  # other C libraries have no arenas
        if mallopt is not None:
            mallopt(_M_ARENA_MAX, _ARENAS)
