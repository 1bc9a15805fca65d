"""Lock: only one process at a time records in a directory."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

from livebode.core import RecordError


class Lock:
    """Locks a directory until it is released or the process ends in any way.

    Raises
    ------
    RecordError
        If another process has locked it.
    """

    def __init__(self, directory: Path) -> None:
        self._directory = os.open(directory, os.O_RDONLY)
        try:
            fcntl.flock(self._directory, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(self._directory)
            raise RecordError(
                "locked",
                f"another process records in {str(directory)!r}",
                "stop it first, or choose another path",
                path=str(directory),
            ) from None

    def release(self) -> None:
        os.close(self._directory)
