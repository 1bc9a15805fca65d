"""Whether an address is this computer's own."""

from __future__ import annotations

from ipaddress import ip_address


def on_loopback(host: str) -> bool:
    """Whether nobody else can reach this name or address.

    >>> on_loopback("localhost"), on_loopback("127.0.0.7"), on_loopback("::1"), on_loopback("0.0.0.0")
    (True, True, True, False)
    """
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False
