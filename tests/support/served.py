"""A command that serves a page, in a process of its own."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.support.browser import until
from tests.support.peers.peer import PATIENCE_S


@contextmanager
def served(folder: Path, *arguments: object, before: str = "") -> Iterator[tuple[subprocess.Popen[str], str]]:
    """The command in a process of its own, and the address that it printed; ended by Ctrl-C, and cleanly."""
    # What starts the tests in the background may have told them to ignore Ctrl-C.
    code = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    code += f"{before}\nfrom livebode.cli import main; main()"
    command = [sys.executable, "-c", code, *map(str, arguments)]
    log = folder / "log.txt"
    with log.open("w") as out:
        process = subprocess.Popen(
            command, stdout=out, stderr=out, text=True, env=os.environ | {"PYTHONUNBUFFERED": "1"}
        )
    found = None

    def printed() -> bool:
        nonlocal found
        found = re.search(r" is at (http\S+)", log.read_text())
        assert process.poll() is None or found, log.read_text()
        return found is not None

    try:
        until(printed, "the address", 60)
        assert found
        yield process, found.group(1)
    finally:
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE_S) in (0, 130), log.read_text()
        assert "Traceback" not in log.read_text(), log.read_text()
