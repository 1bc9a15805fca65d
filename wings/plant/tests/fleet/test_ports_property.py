"""Servers that bind their ports later than they are chosen never share one."""

from __future__ import annotations

from livebode_plant.fleet.server import free_port


def test_no_port_is_given_twice() -> None:
    """Of the 28,000 ports of Linux, 2,000 drawn at random would have some 70 pairs."""
    given = [free_port() for _ in range(2000)]
    assert len(set(given)) == len(given)
