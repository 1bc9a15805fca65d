"""UDP: frames that any sender may send to our port."""

from __future__ import annotations

import socket
import time
from ipaddress import IPv4Address, IPv6Address, ip_address
from typing import ClassVar

from livebode.core import ConfigError, LivebodeError
from livebode.language import Message
from livebode.sources.live.address import Address
from livebode.sources.live.datagrams import receiver
from livebode.sources.live.fields import FieldDecoder, message_decoder
from livebode.sources.live.frame import FrameDecoder
from livebode.sources.live.reach import Reach
from livebode.sources.live.settings import SourceSettings
from livebode.sources.live.source import LiveSource

_SENDERS_MAX = 16
_CHECK_S = 1.0
"""Interval of checks of a port that failed."""
BUFFER_BYTES = 4 << 20
"""Asked of the system; it may grant less (`livebode doctor` reports it)."""


class UdpSource(LiveSource):
    """A frame in each datagram to the port of the URL; the host is the interface to listen on."""

    format: ClassVar[str] = "udp"
    reorders: ClassVar[bool] = True

    def __init__(self, settings: SourceSettings, address: Address) -> None:
        super().__init__(settings, address)
        self._decoder = _decoder(settings)
        try:
            self._sender = None if settings.sender is None else plain_address(settings.sender)
        except ValueError:
            raise ConfigError(
                "value-invalid",
                f"source.sender = {settings.sender!r} is not an IP address",
                "give one such as 192.168.0.5",
                key="source.sender",
                value=settings.sender,
            ) from None

    def reach(self) -> Reach:
        """Nobody answers here, but the port must be ours to receive on."""
        facts = {"address": str(self.address)}
        family = socket.AF_INET6 if ":" in self.address.host else socket.AF_INET
        try:
            with socket.socket(family, socket.SOCK_DGRAM) as port:
                port.bind((self.address.host, self.address.port))
        except OSError as error:
            remedy = "end the program that receives there, perhaps a run of livebode, or check source.url"
            return Reach("failed", f"{self.address}: {error.strerror or error}", remedy, facts)
        return Reach("ok", f"{self.address} is free to receive on", facts=facts)

    def _receive(self) -> bool:
        family = socket.AF_INET6 if ":" in self.address.host else socket.AF_INET
        with socket.socket(family, socket.SOCK_DGRAM) as port:
            port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)
            port.bind((self.address.host, self.address.port))
            self._established()
            self._decoder = _decoder(self.settings)
            with receiver().receiving(port, self._take_datagram) as check:
                while not self._stop.wait(_CHECK_S):
                    check()
        return False

    def _take_datagram(self, datagram: bytes, host: str) -> None:
        sender = self._sender
        if len(self.senders) < _SENDERS_MAX:
            self.senders.add(host)
        if sender is not None and (other := plain_address(host)) != sender:
            self._events.report(
                "foreign",
                Message("a datagram from {other} was dropped; source.sender is {sender}", other=other, sender=sender),
            )
            self._trouble = f"datagrams come from {other}, and source.sender is {sender}"
            return
        try:
            batch = self._decoder.decode(datagram, time.monotonic())
        except LivebodeError as error:
            self._malformed(error, datagram)
            return
        if batch is not None:
            self._deliver(batch)


def _decoder(settings: SourceSettings) -> FrameDecoder | FieldDecoder:
    decoder = message_decoder(settings)
    return decoder if isinstance(decoder, FieldDecoder) else FrameDecoder()


def plain_address(host: str) -> IPv4Address | IPv6Address:
    """The address without a zone; an IPv4 address that an IPv6 port maps to IPv6 is IPv4 again.

    >>> plain_address("::ffff:192.168.0.5"), plain_address("fe80::1%eth0")
    (IPv4Address('192.168.0.5'), IPv6Address('fe80::1'))
    """
    address = ip_address(host.partition("%")[0])
    return getattr(address, "ipv4_mapped", None) or address
