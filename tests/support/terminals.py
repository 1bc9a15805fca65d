"""A command on a terminal of its own, whose user may answer what it asks."""

from __future__ import annotations

import contextlib
import os
import pty
from collections.abc import Sequence
from unittest import mock

from tests.support.forked import Command


def on_terminal(
    *arguments: object, columns: int, kind: str = "xterm-256color", answers: Sequence[tuple[str, str]] = ()
) -> tuple[int, str]:
    """Exit code of `livebode`, and all that it writes; each answer is given when the terminal shows its question."""
    reader, terminal = pty.openpty()
    with mock.patch.dict(os.environ, {"TERM": kind, "COLUMNS": str(columns)}):
        process = Command(*arguments, terminal=terminal)
    os.close(terminal)
    shown, at, rest = b"", 0, list(answers)
    with process:
        with contextlib.suppress(OSError):  # so a terminal ends
            while piece := os.read(reader, 1 << 16):
                shown += piece
                while rest and rest[0][0].encode() in shown[at:] and shown.endswith(b": "):
                    at = len(shown)
                    os.write(reader, f"{rest.pop(0)[1]}\n".encode())
        os.close(reader)
        return process.wait(), shown.decode()
