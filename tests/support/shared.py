"""What costs seconds is computed once for all the processes that run tests."""

from __future__ import annotations

import fcntl
import os
import pickle
from collections.abc import Callable
from functools import cache, wraps
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")
FOLDER = "LIVEBODE_TESTS_SHARED"
"""Environment variable with the path that conftest.py gives to a session of tests."""


def folder() -> Path:
    """Ends with the session; not to be changed by a test."""
    return Path(os.environ[FOLDER])


def shared(compute: Callable[[], T]) -> Callable[[], T]:
    """As functools.cache for a function without arguments, for all processes; what it returns is pickled."""
    name = f"{compute.__module__}.{compute.__qualname__}"

    @cache
    @wraps(compute)
    def found() -> T:
        path = folder() / f"{name}.pickle"
        with (folder() / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not path.exists():
                result = compute()
                path.write_bytes(pickle.dumps(result))
                return result
        return pickle.loads(path.read_bytes())

    return found
