"""A machine that sends over TCP at its pace, and numbers its samples in a channel too."""

from __future__ import annotations

import contextlib
import threading
import time
from functools import cache

import numpy as np

from livebode.core import Channel
from livebode.sources.live import Batch, encode_layout, encode_samples
from tests.support.command import RATE_HZ, signals
from tests.support.peers.plain import TcpPeer

CHANNELS = (Channel("w", "A"), Channel("u", "A"), Channel("y", "rad/s"), Channel("n"))
BATCH = 20
_REPEATED = 20 * RATE_HZ
"""Samples after which w, u and y repeat: whole periods of the excitation."""


def data(samples: int, start: int = 0) -> np.ndarray:
    """w, u, y and the sample's number from a sample on, shape (4, samples)."""
    at = np.arange(start, start + samples)
    return np.vstack([_repeated()[:, at % _REPEATED], at])


@cache
def _repeated() -> np.ndarray:
    columns = signals(_REPEATED)
    return np.array([columns["w"], columns["u"], columns["y"]])


class Machine(TcpPeer):
    """Sends from the first connection on, `times` as fast as its samples would come, until it is left.

    What would have been sent while nobody is connected is lost.
    """

    layout = encode_layout(CHANNELS, float(RATE_HZ), epoch=9)

    def __init__(self, folder: object, times: float = 2.0) -> None:
        super().__init__(folder)
        self._times, self._done = times, threading.Event()
        self.sent = 0
        """Samples that were sent."""

    def __enter__(self) -> Machine:
        super().__enter__()
        self._sender = threading.Thread(target=self._send, daemon=True)
        self._sender.start()
        return self

    def __exit__(self, *error: object) -> None:
        self.silence()
        super().__exit__(*error)

    def silence(self) -> None:
        """Send no more, but stay connected."""
        self._done.set()
        self._sender.join()

    def _send(self) -> None:
        while self._link is None and not self._done.wait(0.01):
            pass
        began = time.monotonic()
        while not self._done.is_set():
            due = int((time.monotonic() - began) * RATE_HZ * self._times)
            for start in range(self.sent, due - BATCH, BATCH):
                batch = Batch(start, data(BATCH, start), CHANNELS, float(RATE_HZ), 9)
                with contextlib.suppress(OSError):  # livebode has ended
                    self._link.sendall(encode_samples(batch, double=True))
                self.sent = start + BATCH
            time.sleep(0.005)
