"""ServiceManager: tells systemd when a run is ready, works, reads its configuration again, and stops (sd_notify(3))."""

from __future__ import annotations

import logging
import os
import socket
import time
from collections.abc import Mapping

_SEND_S = 1.0
_logger = logging.getLogger(__name__)


class ServiceManager:
    """The service manager that started this process, or nobody.

    Parameters
    ----------
    environment
        `NOTIFY_SOCKET` is the address of its datagram socket; without it nothing is sent. `WATCHDOG_USEC` is the time
        after which it ends a process that does not report, for the process `WATCHDOG_PID`.
    """

    def __init__(self, environment: Mapping[str, str] = os.environ) -> None:
        address = environment.get("NOTIFY_SOCKET", "")
        self._address = f"\0{address[1:]}" if address.startswith("@") else address
        is_ours = environment.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
        self.patience_s = int(environment.get("WATCHDOG_USEC", "0")) / 2e6 if is_ours else 0.0
        """Half of the watchdog's time; 0 without a watchdog."""
        self._state, self._reported_s = "", 0.0

    def ready(self) -> None:
        """The configuration was checked, and its axes have begun."""
        self._change("READY=1")

    def reloading(self) -> None:
        """The configuration is read again; `ready` ends this."""
        self._change(f"RELOADING=1\nMONOTONIC_USEC={time.monotonic_ns() // 1000}")

    def stopping(self) -> None:
        """The runs are being finished."""
        self._change("STOPPING=1")

    def working(self) -> None:
        """Report to the watchdog that everything works, as often as it needs to know."""
        now_s = time.monotonic()
        if self.patience_s and now_s - self._reported_s >= self.patience_s / 2:
            self._reported_s = now_s
            self._send("WATCHDOG=1")

    def _change(self, message: str) -> None:
        state = message.partition("=")[0]
        if state != self._state:
            self._state = state
            self._send(message)

    def _send(self, message: str) -> None:
        if not self._address:
            return
        try:
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as link:
                link.settimeout(_SEND_S)
                link.sendto(message.encode(), self._address)
        except OSError as error:  # a run does not end because nobody listens to it
            _logger.warning("the service manager was not reached at %s: %s", self._address.lstrip("\0"), error)
