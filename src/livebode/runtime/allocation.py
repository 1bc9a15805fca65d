"""How a process with many threads allocates memory, so that an axis takes little of it."""

from __future__ import annotations

import ctypes
import sys

import pyarrow as pa

_M_MMAP_THRESHOLD, _M_ARENA_MAX = -3, -8  # of glibc's malloc.h
_ARENAS = 1
_OWN_BYTES = 1 << 16


def share_between_threads() -> None:
    """Let all threads take their memory from the same few places; to be called before the threads are started.

    glibc gives each thread an arena of its own, up to eight for each core, and Arrow's own allocator a heap: what one
    thread has freed is then not used by the others. Each axis has several threads. Arrays from 64 KB on are pages of
    their own, which the system has again when they are freed; with glibc's threshold, which grows to 32 MB, they leave
    holes among what is retained.
    """
    pa.set_memory_pool(pa.system_memory_pool())
    if sys.platform == "linux":
        mallopt = getattr(ctypes.CDLL(None), "mallopt", None)  # other C libraries have no arenas
        if mallopt is not None:
            mallopt(_M_ARENA_MAX, _ARENAS)
            mallopt(_M_MMAP_THRESHOLD, _OWN_BYTES)
