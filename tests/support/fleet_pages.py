"""A fleet whose page a test drives: it decides what the workers report, and knows the truth axis by axis."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from livebode.dashboard import Dashboard, ServerSettings
from livebode_plant.fleet.status_message import ACTIVE, BEHIND, NOT_READY, SILENT, STATES, encode_names, encode_status
from livebode_plant.page.fleet_board import LOOKS, FleetAct
from livebode_plant.page.fleet_feed import DemoFleet, Hear
from livebode_plant.page.fleet_pages import FleetView


class DrivenFeed:
    """Sends the state of a fleet that a test sets, ten times a second, except of dead partitions."""

    def __init__(self, fleet: DemoFleet, after_s: float) -> None:
        self.fleet, self.name, self.trouble, self.may_act = fleet, "plant", "", True
        self.status = fleet.status(after_s, time.time())
        self.dead: set[int] = set()
        self._acts: list[bytes] = []

    async def run(self, hear: Hear, hear_act: Hear) -> None:
        tables = {}
        for names in self.fleet.names():
            message, tables[names.partition] = encode_names(names, time.time())
            hear(message)
        while True:
            for number, table in tables.items():
                if number not in self.dead:
                    hear(encode_status(number, table, self.status[self.fleet.part(number)], time.time(), 5, 0.3))
            while self._acts:
                hear_act(self._acts.pop(0))
            await asyncio.sleep(0.1)

    async def publish(self, act: FleetAct) -> None:
        self._acts.append(act.to_bytes())

    def raise_alarm(self, axis: int) -> None:
        """A new alarm of high priority."""
        status = self.status.copy()
        status["raised"][axis] += 1
        status["flags"][axis] |= ACTIVE
        status["state"][axis], status["kind"][axis], status["priority"][axis] = 3, 1, 3
        status["raised_s"][axis] = int(time.time())
        self.status = status


def expected_look(row: np.void, seen: int = 0) -> str:
    """How an axis looks whose worker lives, written out."""
    active, raised = bool(row["flags"] & ACTIVE), int(row["raised"])
    if raised > seen and active and row["flags"] & NOT_READY:
        return "not ready"
    if raised > seen:
        return "alarm" if active else "returned"
    for flag, look in ((SILENT, "silent"), (BEHIND, "behind")):
        if row["flags"] & flag:
            return look
    if active:
        return "acknowledged"
    return "not ready" if row["flags"] & NOT_READY else STATES[row["state"]]


def expected_looks(status: np.ndarray) -> list[int]:
    """Numbers of the looks."""
    return [LOOKS.index(expected_look(row)) for row in status]


@contextmanager
def fleet_page(
    axes: int, after_s: float = 130.0, plan: str | None = None, lake: str = ""
) -> Iterator[tuple[str, DrivenFeed]]:
    """Address and feed of a page that is served."""
    feed = DrivenFeed(DemoFleet(axes), after_s)
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.show(FleetView(feed, plan, lake=lake))
    with dashboard:
        yield dashboard.url, feed
