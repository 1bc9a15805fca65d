"""How many files and connections the process of a session may have open."""

from __future__ import annotations

from contextlib import suppress

OPEN_FILES = 1 << 14
"""Enough for 256 axes, each with some files, and for the page."""


def allow_open_files() -> None:
    """Raise the limit of this process, which is often 1,024, as far as the system permits it, up to `OPEN_FILES`."""
    with suppress(ImportError, OSError, ValueError):  # not a POSIX system, or one that does not permit it
        import resource

        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        required = OPEN_FILES if hard == resource.RLIM_INFINITY else min(OPEN_FILES, hard)
        if soft != resource.RLIM_INFINITY and soft < required:
            resource.setrlimit(resource.RLIMIT_NOFILE, (required, hard))
