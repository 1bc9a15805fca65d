"""FleetView: passes the messages of a feed to the board, some times a second, and wakes the browsers."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from dataclasses import dataclass, field

from livebode.core import LivebodeError
from livebode.dashboard import Act, AlarmRequest, Pulse
from livebode_plant.page.fleet_board import FleetBoard
from livebode_plant.page.fleet_feed import StatusFeed

TICK_S, IDLE_S = 0.25, 1.0
"""Between two updates of the board, with and without browsers."""
RETRY_S = 2.0
_WAITING_MAX = 1 << 14


@dataclass
class FleetView:
    """What `livebode fleet status --serve` shows.

    Attributes
    ----------
    feed
        Source of the messages.
    plan
        SVG of a floor plan; None without one.
    trends
        Address of a page of trends, to which "#axis=PATH" is appended; empty without one.
    lake
        Directory or URL of the lake with the results of the fleet; empty without one.
    """

    feed: StatusFeed
    plan: str | None = None
    trends: str = ""
    lake: str = ""
    board: FleetBoard = field(default_factory=FleetBoard)
    pulse: Pulse = field(default_factory=Pulse)
    browsers: int = 0
    _messages: deque[bytes] = field(default_factory=lambda: deque(maxlen=_WAITING_MAX))
    _acts: deque[bytes] = field(default_factory=deque)

    async def run(self) -> None:
        """Follow the feed until it is cancelled."""
        following = asyncio.create_task(self._follow())
        try:
            while not following.done():
                self._tick()
                await asyncio.wait([following], timeout=TICK_S if self.browsers else IDLE_S)
            following.result()
        finally:
            following.cancel()

    async def act(self, act: Act, asked: AlarmRequest) -> None:
        """Do what a person asks for; LivebodeError if it is impossible."""
        await self.feed.publish(self.board.act(act, asked, time.time()))

    async def _follow(self) -> None:
        while True:
            try:
                await self.feed.run(self._messages.append, self._acts.append)
            except LivebodeError as error:
                self.feed.trouble = str(error)
            await asyncio.sleep(RETRY_S)

    def _tick(self) -> None:
        now_s, board = time.time(), self.board
        messages = [self._messages.popleft() for _ in range(len(self._messages))]
        board.process(messages, now_s)
        while self._acts:
            board.process_act(self._acts.popleft())
        board.refresh(now_s)
        self.pulse.beat()
