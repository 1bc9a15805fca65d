"""What the contract of live sources asks of the machine at the other end."""

from __future__ import annotations

import os
import shutil
import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from livebode.core import Channel
from livebode.sources.live import Batch, LiveBlock, LiveSource, SourceSettings, open_source

CHANNELS = (Channel("w", "N m"), Channel("y", "rad/s"))
RATE_HZ = 4000.0
SAMPLES = 50
PATIENCE_S = 300.0
"""Only against waiting for ever: a busy computer may take a minute for what else takes a second."""
STAMP_S = 1.8e9


def batches(count: int, first: int = 1000, epoch: int = 0) -> list[Batch]:
    """Consecutive batches; the first channel holds the sample's number, the second noise of every magnitude."""
    rng = np.random.default_rng(first)
    found = []
    for start in range(first, first + count * SAMPLES, SAMPLES):
        noise = rng.standard_normal(SAMPLES) * 10.0 ** rng.integers(-12, 12, SAMPLES)
        data = np.stack([np.arange(start, start + SAMPLES, dtype=float), noise])
        found.append(Batch(start, data, CHANNELS, RATE_HZ, epoch, STAMP_S + start / RATE_HZ))
    return found


def taken(blocks: Iterator[LiveBlock], count: int) -> list[LiveBlock]:
    """The next Blocks with the samples of so many batches: those that wait together are one Block."""
    found: list[LiveBlock] = []
    while sum(len(block) for block in found) < count * SAMPLES:
        found.append(next(blocks))
    return found


class Peer:
    """A machine that sends. `settings` are the keys of [source] that reach it."""

    settings: dict[str, Any]
    reconnects = True
    """Whether there is a connection that can break."""
    numbers_begin_anew = True
    """Whether a restart begins its numbers anew; those from a clock go on."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __enter__(self) -> Peer:
        return self

    def __exit__(self, *_: object) -> None:
        raise NotImplementedError

    def wait_ready(self) -> None:
        """Until livebode listens."""

    def send(self, batch: Batch) -> None:
        raise NotImplementedError

    def send_rubbish(self) -> None:
        """Something that is no batch."""
        raise NotImplementedError

    def lose(self, lost: Sequence[Batch]) -> None:
        """Take these samples so that they do not, or not all, arrive: a machine that sends them into nothing."""

    def interrupt(self) -> None:
        """Break the connection, and be there again."""
        raise NotImplementedError

    def end(self) -> None:
        """Say that there is no more, where the transport can say it."""


class Feeding:
    """Runs a script of the peer in a thread beside the source; what it raises fails the test."""

    def __init__(self, script: Callable[[], None]) -> None:
        self._script, self._error = script, None
        self._thread = threading.Thread(target=self._run, daemon=True)

    def _run(self) -> None:
        try:
            self._script()
        except BaseException as error:
            self._error = error

    def __enter__(self) -> Feeding:
        self._thread.start()
        return self

    def join(self) -> None:
        """Waits for the script's end."""
        self._thread.join(PATIENCE_S)
        if self._error is not None:
            raise self._error

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.join()
        assert kind is not None or not self._thread.is_alive()


def send_all(peer: Peer, given: Sequence[Batch], pause_s: float = 0.001) -> None:
    for batch in given:
        peer.send(batch)
        time.sleep(pause_s)


def until(condition: Callable[[], Any], what: str) -> Any:
    """Waits for something to become true; this bounds a hang, it measures nothing."""
    end = time.monotonic() + PATIENCE_S
    while True:
        began = time.monotonic()
        if found := condition():
            return found
        assert time.monotonic() < end, f"{what} did not happen within {PATIENCE_S} s"
        # What costs much is looked at less often: what is waited for needs the processor.
        time.sleep(min(max(0.01, 8 * (time.monotonic() - began)), 0.25))


def free_port(kind: int = socket.SOCK_STREAM) -> int:
    with socket.socket(socket.AF_INET, kind) as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


def program(name: str) -> str:
    """Path of a program from a Debian package; where it is missing the test is skipped, and fails in CI."""
    path = shutil.which(name, path=os.environ.get("PATH", "") + ":/usr/sbin:/usr/local/sbin")
    if path is None:
        message = f"{name} is not installed; `make system-packages` (as root) installs it"
        if os.environ.get("CI"):
            pytest.fail(message)
        pytest.skip(message)
    return path


def opened(peer: Peer, **more: object) -> LiveSource:
    return open_source(SourceSettings(**(peer.settings | {"timeout_s": PATIENCE_S} | more)))


@contextmanager
def fed(peer, script, **more):
    """A source that is open until the script has ended, for a peer that still sends to a closed one fails."""
    with Feeding(script) as feeding, opened(peer, **more) as source:
        yield source
        feeding.join()
