"""How much UDP data the system holds for us while we are busy."""

from __future__ import annotations

import contextlib
import socket
import sys
from collections.abc import Mapping

from livebode.configuration import Axis
from livebode.doctor.check import Check
from livebode.sources.live import BUFFER_BYTES

NAME = "UDP receive buffer"


def check_udp_buffer(axes: Mapping[str, Axis]) -> Check:
    """What the system grants of what a UDP source asks for; not applicable where no axis of several receives UDP."""
    if axes and not any((axis.source.url or "").startswith("udp:") for axis in axes.values()):
        return Check(NAME, "not applicable", "no axis receives UDP")
    return judged(_granted_bytes(), BUFFER_BYTES)


def judged(granted_bytes: int, asked_bytes: int) -> Check:
    """The check of what was granted.

    >>> judged(4 << 20, 4 << 20).verdict, judged(212992, 4 << 20).verdict
    ('ok', 'warning')
    """
    facts = {"granted_bytes": granted_bytes, "asked_bytes": asked_bytes}
    message = f"the system grants {granted_bytes} bytes of {asked_bytes}"
    if granted_bytes >= asked_bytes:
        return Check(NAME, "ok", message, facts=facts)
    name = "net.core.rmem_max" if sys.platform.startswith("linux") else "kern.ipc.maxsockbuf"
    remedy = f"run `sysctl -w {name}={asked_bytes}` as administrator, or samples are lost while the computer is busy"
    return Check(NAME, "warning", message, remedy, facts)


def _granted_bytes() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        with contextlib.suppress(OSError):  # where a system refuses more than its maximum
            port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)
        granted = port.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
    return granted // 2 if sys.platform.startswith("linux") else granted  # Linux doubles it for its own bookkeeping
