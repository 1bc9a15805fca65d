"""Processes that begin where all that takes long to import is imported: for tests of what they do, not of their start.

A server that has imported it is forked; it starts a process in some milliseconds, where Python and livebode take a
second of the processor.
"""

from __future__ import annotations

import contextlib
import io
import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerContext
from pathlib import Path
from typing import BinaryIO, Self

_IMPORTED = [
    "livebode.cli.app", "livebode.cli.run_command", "livebode.cli.serving", "livebode.pictures.bode",
    "livebode.pictures.tracking", "livebode.runtime._run", "livebode.runtime._demo", "livebode.sources.live.lines",
    "livebode_plant.fleet.sink", "livebode_plant.fleet.worker",
    "nats.aio.client", "pyarrow.parquet", "scipy.optimize",
    "scipy.signal",
    "tests.support.forked", "tests.support.killed", "tests.support.killed_live",
]  # fmt: skip


def server() -> ForkServerContext:
    """The context of multiprocessing whose processes begin so."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_IMPORTED)
    return context


class Command:
    """`livebode` with these arguments, and what of subprocess.Popen the tests use.

    With the descriptor of a `terminal`, all three streams are that.
    """

    def __init__(self, *arguments: object, terminal: int | None = None) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="livebode-command-")
        self._printed = [Path(self._folder.name, name) for name in ("out", "err")]
        read, write = server().Pipe(duplex=False)
        self.stdin: BinaryIO = os.fdopen(os.dup(write.fileno()), "wb")
        write.close()
        if terminal is not None:
            read.close()
            read = Connection(os.dup(terminal))
        here = (list(map(str, arguments)), dict(os.environ), os.getcwd())
        printed = self._printed if terminal is None else []
        self._process = server().Process(target=_run, args=(read, printed, *here))
        self._process.start()
        read.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()
        self.wait()
        with contextlib.suppress(BrokenPipeError):
            self.stdin.close()
        self._folder.cleanup()

    @property
    def pid(self) -> int:
        return self._process.pid or 0

    @property
    def returncode(self) -> int | None:
        return self._process.exitcode

    def poll(self) -> int | None:
        return self._process.exitcode

    @property
    def printed(self) -> bytes:
        """Its standard output until now."""
        return self._until_now(0)

    @property
    def reported(self) -> bytes:
        """Its standard error until now."""
        return self._until_now(1)

    def _until_now(self, stream: int) -> bytes:
        path = self._printed[stream]
        return path.read_bytes() if path.exists() else b""

    def wait(self, timeout: float | None = None) -> int:
        self._process.join(timeout)
        if self._process.exitcode is None:
            raise subprocess.TimeoutExpired("livebode", timeout or 0.0)
        return self._process.exitcode

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)

    def communicate(self, input: bytes = b"", timeout: float | None = None) -> tuple[bytes, bytes]:
        """Write to its standard input and close it, wait for its end, return standard output and error."""
        with contextlib.suppress(BrokenPipeError):
            self.stdin.write(input)
        with contextlib.suppress(BrokenPipeError):
            self.stdin.close()
        self.wait(timeout)
        out, err = (path.read_bytes() for path in self._printed)
        return out, err


def _run(
    given: Connection,
    printed: list[Path],
    arguments: list[str],
    environment: dict[str, str],
    directory: str,
) -> None:
    for number in range(3):
        os.dup2(given.fileno(), number)
    given.close()
    for number, path in enumerate(printed, 1):
        with path.open("wb") as file:
            os.dup2(file.fileno(), number)
    sys.stdin, sys.stdout, sys.stderr = (
        io.TextIOWrapper(open(number, mode, closefd=False), encoding="utf-8", line_buffering=number == 2)  # noqa: SIM115
        for number, mode in enumerate(("rb", "wb", "wb"))
    )
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(directory)
    # What starts the tests in the background may have told them to ignore Ctrl-C.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.argv = ["livebode", *arguments]
    from livebode.cli import main

    main()
