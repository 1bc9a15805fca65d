"""The page of a fleet: cost of the board, bytes to the browser, time until an alarm is seen, frames while scrolling.

    python -m bench.fleet_page [--axes 100000] [--partitions 1024] [--seconds 20]

Status messages of all partitions are encoded as workers do, once a second. The cost of taking them, of the states and
of the lists is the processor time of the thread that does it, in percent of the time for which the messages are. The
time of an alarm is from its cause to the browser's list. Chromium is headless, without a graphics card, on the same
cores.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import time

import numpy as np

from bench.browser import chromium
from livebode.dashboard import Dashboard, ServerSettings
from livebode_plant.fleet.status_message import ACTIVE, AxisName, PartitionNames, encode_names, encode_status
from livebode_plant.page.fleet_board import FleetAct, FleetBoard
from livebode_plant.page.fleet_feed import DemoFleet, Hear
from livebode_plant.page.fleet_pages import TICK_S, FleetView, tiles_frame

_FRAMES = """async (seconds) => {
  const { tiles } = window.livebode, end = performance.now() + 1000 * seconds;
  let frames = 0, way = 40;
  while (performance.now() < end) {
    tiles.host.scrollTop += way;
    if (tiles.host.scrollTop + tiles.host.clientHeight >= tiles.host.scrollHeight - 1 || tiles.host.scrollTop <= 0)
      way = -way;
    await new Promise(requestAnimationFrame);
    frames++;
  }
  return frames / seconds;
}"""


class Plant:
    """A fleet in partitions, and its messages of each second; a feed too."""

    def __init__(self, axes: int, partitions: int) -> None:
        self.fleet, self.name, self.trouble, self.may_act = DemoFleet(axes), "bench", "", True
        self.parts = np.array_split(np.arange(len(self.fleet.paths)), partitions)
        self.alarms: list[int] = []
        self.names, self.tables = [], []
        for number, part in enumerate(self.parts):
            names = tuple(AxisName(self.fleet.paths[axis], "stiffness", "N/m") for axis in part)
            kinds = ("", "change", "gap", "disconnected", "backlog")
            message, table = encode_names(PartitionNames(number, f"w{number // 16}", names, kinds), 1.0)
            self.names.append(message)
            self.tables.append(table)

    def messages(self, after_s: float, now_s: float) -> list[bytes]:
        status = self.fleet.status(after_s, now_s)
        for axis in self.alarms:
            status[axis]["raised"] += 1
            status[axis]["flags"] |= ACTIVE
            status[axis]["kind"], status[axis]["priority"], status[axis]["raised_s"] = 1, 3, int(now_s)
        found = []
        for number, (part, table) in enumerate(zip(self.parts, self.tables)):
            rows = status[part]
            rows["axis"] = np.arange(len(part))
            found.append(encode_status(number, table, rows, now_s))
        return found

    async def run(self, hear: Hear, _: Hear) -> None:
        began_s = time.time()
        for message in self.names:
            hear(message)
        while True:
            now_s = time.time()
            for message in self.messages(150 + now_s - began_s, now_s):
                hear(message)
            await asyncio.sleep(max(0.0, 1.0 - (time.time() - now_s)))

    async def publish(self, _: FleetAct) -> None:
        """Nobody acts."""


def board_cost(plant: Plant, seconds: int) -> None:
    """Take the messages of some seconds in the ticks of a page."""
    board, began_s = FleetBoard(), time.time()
    before = time.thread_time()
    board.process(plant.names, began_s)
    print(f"names of {len(board.axes)} axes, once: {time.thread_time() - before:.2f} s of a core")
    before = time.thread_time()
    _ = board.looks
    print(f"their order, once: {time.thread_time() - before:.2f} s of a core")
    ticks, cost_s, last = round(1 / TICK_S), 0.0, None
    sizes, status_bytes = [], 0
    lists = (lambda _: board.worst(), board.open_alarms, board.workers)  # a page shows one of them
    for second in range(seconds):
        now_s = began_s + second
        messages = plant.messages(150 + second, now_s)
        status_bytes = sum(map(len, messages))
        for tick, part in enumerate(np.array_split(np.arange(len(messages)), ticks)):
            before = time.thread_time()
            board.process([messages[i] for i in part], now_s + tick * TICK_S)
            board.refresh(now_s + tick * TICK_S)
            looks = board.looks
            sizes.append(len(tiles_frame(board.layout, looks, last)))
            last = looks
            if tick % 2 == 0:
                _ = board.open_count
                lists[(second * ticks + tick) // 2 % 3](now_s)
            cost_s += time.thread_time() - before
    axes = len(board.axes)
    print(f"status: {status_bytes / axes:.1f} B an axis and second, headers included")
    print(f"board, tiles and lists: {100 * cost_s / seconds:.1f} % of a core at {axes} axes (limit 5 %)")
    print(f"to the browser: all tiles {sizes[0] / 1000:.0f} kB, then {np.mean(sizes[ticks:]) / 1000:.2f} kB an update")


def page_cost(plant: Plant, seconds: float) -> None:
    """Open the page, raise an alarm, scroll."""
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.show(FleetView(plant))
    with dashboard, chromium() as browser:
        for words, viewport in (("desktop", (1440, 900)), ("telephone", (390, 844))):
            page = browser.new_page(viewport={"width": viewport[0], "height": viewport[1]})
            page.goto(dashboard.url + "#list=alarms")
            page.wait_for_function("() => window.livebode?.tiles.shown.length && livebode.feed.frames > 2")
            if words == "desktop":
                calm = int(np.flatnonzero(plant.fleet.status(150, time.time())["raised"] == 0)[0])
                began_s = time.perf_counter()
                plant.alarms.append(calm)
                page.wait_for_function(f"() => livebode.lists.known.has({plant.fleet.paths[calm]!r})")
                print(f"an alarm was in the list after {time.perf_counter() - began_s:.2f} s (limit 2 s)")
                before = dashboard.cpu_s
                page.wait_for_timeout(1000 * seconds / 2)
                share = 100 * (dashboard.cpu_s - before) / (seconds / 2)
                print(f"thread of the server with one page, encoding of the simulated fleet included: {share:.1f} %")
            for size in ("small", "large"):
                page.locator(f"#sizes [data-value={size}]").click()
                rate = page.evaluate(_FRAMES, seconds / 4)
                print(f"{words}, {size} tiles: {rate:.0f} frames/s while scrolling (limit 30)")
            page.close()


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.fleet_page", description=__doc__)
    parser.add_argument("--axes", type=int, default=100_000)
    parser.add_argument("--partitions", type=int, default=1024)
    parser.add_argument("--seconds", type=float, default=20.0)
    given = parser.parse_args()
    plant = Plant(given.axes, given.partitions)
    board_cost(plant, max(3, round(given.seconds / 2)))
    page_cost(plant, given.seconds)
    print(f"load of the computer: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


if __name__ == "__main__":
    main()
