"""A device at a serial port: a pseudo terminal, under a name that stays when the device is plugged in again."""

from __future__ import annotations

import contextlib
import fcntl
import os
import select
import struct
import termios
import time
import tty

from livebode.sources.live import Batch, encode_layout, encode_line, encode_samples
from tests.support.peers.peer import CHANNELS, PATIENCE_S, RATE_HZ, Peer, until

_TIOCPKT_FLUSHREAD = 1
"""A pseudo terminal in packet mode tells the device's end that its port was emptied."""


class SerialPeer(Peer):
    more: dict[str, object]
    """Keys of [source] in addition to the URL."""

    def __enter__(self) -> SerialPeer:
        self._name = self.folder / "ttyACM0"
        self.settings = {"url": f"serial:{self._name}"} | self.more
        self.plug_in()
        return self

    def __exit__(self, *_: object) -> None:
        self.unplug()

    def plug_in(self) -> None:
        self._device, port = os.openpty()
        tty.setraw(port)
        self._name.symlink_to(os.ttyname(port))
        os.close(port)  # from now on the device sees whether somebody has opened the port
        fcntl.ioctl(self._device, termios.TIOCPKT, struct.pack("i", 1))
        os.set_blocking(self._device, False)

    def unplug(self) -> None:
        with contextlib.suppress(FileNotFoundError):
            self._name.unlink()
            os.close(self._device)

    def _opened(self) -> bool:
        poll = select.poll()
        poll.register(self._device, select.POLLOUT)
        return not any(events & select.POLLHUP for _, events in poll.poll(0))

    def wait_ready(self) -> None:
        until(self._emptied, "the port to be opened and emptied")
        self.write(self.greeting)

    def _emptied(self) -> bool:
        """Whether livebode has dropped what the port had before: what is sent earlier may be lost with it."""
        try:
            return bool(os.read(self._device, 1)[0] & _TIOCPKT_FLUSHREAD)
        except OSError:  # nothing happened, or the port is closed
            return False

    greeting = b"\n"

    def write(self, data: bytes) -> None:
        """All of it, as fast as the port is read; what nobody reads is lost."""
        end = time.monotonic() + PATIENCE_S
        while data and time.monotonic() < end and self._opened():
            with contextlib.suppress(BlockingIOError):
                data = data[os.write(self._device, data) :]
            if data:
                select.select([], [self._device], [], 0.05)

    def send_rubbish(self) -> None:
        self.write(b"\0\xfe 1,2,3 { LBOX\r\n")

    def interrupt(self) -> None:
        """Unplug it and plug it in again; what was not read goes with it."""
        self.unplug()
        self.plug_in()
        self.wait_ready()


class SerialNumbersPeer(SerialPeer):
    more = {"channels": [f"{c.name} [{c.unit}]" for c in CHANNELS], "counter": "w", "rate_hz": RATE_HZ}  # noqa: RUF012

    def send(self, batch: Batch) -> None:
        self.write(b"".join(b"%d,%r\r\n" % (int(count), value) for count, value in batch.data.T.tolist()))


class SerialJsonPeer(SerialPeer):
    more = {"baud_rate": 921_600}  # noqa: RUF012

    def send(self, batch: Batch) -> None:
        self.write(encode_line(batch))


class SerialFramesPeer(SerialPeer):
    more = {"baud_rate": 921_600}  # noqa: RUF012
    greeting = encode_layout(CHANNELS, RATE_HZ)

    def send(self, batch: Batch) -> None:
        self.write(encode_samples(batch, double=True))
