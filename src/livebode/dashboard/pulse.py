"""Pulse: wakes all browsers for an update."""

from __future__ import annotations

import asyncio


class Pulse:
    """Wakes all that wait for the next update."""

    def __init__(self) -> None:
        self._next = asyncio.Event()

    async def wait_next(self) -> None:
        """Wait for the next update."""
        await self._next.wait()

    def beat(self) -> None:
        """Wake all that wait now."""
        before, self._next = self._next, asyncio.Event()
        before.set()
