"""A drive on a bus of python-can's virtual interface, which another bus object of the same process receives."""

from __future__ import annotations

import itertools
import os
import struct

import can

from livebode.sources.live import Batch
from tests.support.peers.peer import RATE_HZ, STAMP_S, Peer, until

COUNTED = """VERSION ""
BU_: Drive
BO_ 291 Drive: 16 Drive
 SG_ w : 0|32@1+ (1,0) [0|0] "N m" Drive
 SG_ y : 64|64@1- (1,0) [0|0] "rad/s" Drive
SIG_VALTYPE_ 291 y : 2;
"""
"""A message with a counter, as long as CAN FD permits."""
_NUMBERS = itertools.count()


class CanPeer(Peer):
    reconnects = False
    """Nothing can break the virtual bus; tests of its own make a bus go off."""

    def __enter__(self) -> CanPeer:
        self.channel = f"livebode-{os.getpid()}-{next(_NUMBERS)}"
        dbc = self.folder / "drive.dbc"
        dbc.write_text(COUNTED)
        self.settings = {
            "url": f"can:virtual/{self.channel}", "dbc": dbc, "rate_hz": RATE_HZ, "channels": ["w", "y"],
            "counter": "w", "can_fd": True, "bitrate": 1_000_000,
        }  # fmt: skip
        self._bus = can.Bus(interface="virtual", channel=self.channel, preserve_timestamps=True)
        return self

    def __exit__(self, *_: object) -> None:
        self._bus.shutdown()

    def wait_ready(self) -> None:
        until(lambda: len(self._bus.channel) > 1, "the bus to be opened")

    def frame(self, number: int, data: bytes, time_s: float, **more: object) -> None:
        self._bus.send(
            can.Message(timestamp=time_s, arbitration_id=number, data=data, is_extended_id=False, **more), timeout=0
        )

    def send(self, batch: Batch) -> None:
        for k, (w, y) in enumerate(batch.data.T.tolist()):
            stamp = STAMP_S + (batch.first_sample + k) / RATE_HZ
            self.frame(291, struct.pack("<Q", int(w)) + struct.pack("<d", y), stamp, is_fd=True)

    def send_rubbish(self) -> None:
        self.frame(291, b"\xff" * 3, STAMP_S)
        self.frame(0x7FF, b"\xff" * 8, STAMP_S)
