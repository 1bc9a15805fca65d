"""`python -m studies.soak`: the memory of a live process over a simulated day, with the page open.

Four axes at 4 kHz come over TCP, 21 lines at 20 responses a second, with a record in segments; the first one has fits
and margins. A dashboard serves them, and one client reads all that the page would. Every 30 s of the machine half a
second is missing. The senders keep in step and wait until livebode has tracked what they sent, so that the machine's
clock runs as fast as the computer permits; they are so little ahead that nothing is left out as in a backlog.

A live run processes at most a quarter of a second at once and commits each half second. Here it is 2 s of the machine
for both, which is less than half a second of the computer at four times the machine's speed. Forty responses fitted at
once cost as much as fifteen in fives, so that the whole needs a third of the processor time. `--as-live` keeps the
intervals of a live run.

Resident memory is read each half minute of the machine; the slope is that of a least-squares line after the warm-up.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import socket
import tempfile
import threading
import time
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.sharedctypes import Synchronized
from multiprocessing.synchronize import Event as Flag
from pathlib import Path

import numpy as np
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from livebode.configuration import Axis
from livebode.core import Channel, Lines
from livebode.dashboard import Dashboard, ServerSettings
from livebode.excitation import multisine
from livebode.runtime import Destination, Document, Session, TrackerResults, segmented
from livebode.simulation import TwoMassLoop
from livebode.simulation.two_mass_loop import RATE_HZ
from livebode.sources.live import Batch, encode_layout, encode_samples
from studies.drawing import LIGHT, figure_of

AXES = 4
AT_ONCE_S, AT_ONCE_AS_LIVE_S = 2.0, 0.5
LOST, LOSS_EVERY_S = 2000, 30.0
WINDOW = 400
LINES = Lines.parse("20:220:10", RATE_HZ, WINDOW)
CHANNELS = (Channel("w", "N m"), Channel("u", "N m"), Channel("y", "rad/s"))
EVERY_S = 30.0
WARM_UP_H = 0.5
MB_PER_H_MAX = 5.0
IMAGE = Path(__file__).parents[1] / "docs" / "images" / "soak.png"
LOOP = {"velocity": {"gain": 0.2308, "integral_time_s": 0.2, "rate_hz": RATE_HZ}}


@dataclass
class Curve:
    """Resident memory in MB over hours of the machine, and how long the end took."""

    hours: list[float] = field(default_factory=list)
    resident_mb: list[float] = field(default_factory=list)
    stop_s: float = float("nan")
    took_s: float = float("nan")
    lost: int = 0
    responses: int = 0
    fits: int = 0

    @property
    def speed(self) -> float:
        """Of the machine's clock, times real time."""
        return 3600 * self.hours[-1] / self.took_s

    @property
    def slope_mb_per_h(self) -> float:
        """Behind the warm-up, or behind a quarter of a run that is shorter than four of them."""
        hours, resident = np.array(self.hours), np.array(self.resident_mb)
        behind = hours >= min(WARM_UP_H, hours[-1] / 4)
        return float(np.polyfit(hours[behind], resident[behind], 1)[0])


class Progress:
    """Reports how many samples of an axis were tracked, to the sender in another process."""

    def __init__(self, done: Synchronized[int]) -> None:
        self._done = done

    def __call__(self, document: Document) -> None:
        if isinstance(document, TrackerResults):
            self._done.value = document.block.stop


def axis(port: int, *, fitted: bool) -> Axis:
    data: dict[str, object] = {
        "source": {"url": f"tcp://127.0.0.1:{port}"},
        "signals": {"excitation": "w", "input": "u", "output": "y"},
        "lines": {"frequencies": ",".join(f"k={k}" for k in LINES.bins), "window": WINDOW},
        "loop": LOOP,
        "record": {"budget_bytes": 64 << 20},
    }
    if fitted:
        data["fit"] = {"model": "two-mass", "output": "velocity", "radius_m": 0.019}
    return Axis.of(data, "soak")


def machines(listeners: list[socket.socket], done: list[Synchronized[int]], batch: int, url: str, end: Flag) -> None:
    """The process beside: the axes' senders, and what the page of a browser takes in."""
    page = threading.Thread(target=look_on, args=(url, end))
    page.start()
    w = 0.3 * multisine(LINES)
    u, y = TwoMassLoop().run(w, 160, sigma=0.1, seed=0)
    data = np.array([np.resize(w, u.shape[1]), u[0], y[0]])
    links = [listener.accept()[0] for listener in listeners]
    for link in links:
        link.sendall(encode_layout(CHANNELS, RATE_HZ, epoch=7))
    turns = [0] * len(links)
    while not end.is_set():
        slowest = min(one.value for one in done)
        due = [n for n, turn in enumerate(turns) if (turn - 1) * batch <= slowest]
        if not due:
            time.sleep(0.002)
        for n in due:
            first = turns[n] * batch
            at = (first + n * batch) % data.shape[1]
            sent = data[:, at : at + batch - LOST * ((first + batch) % (LOSS_EVERY_S * RATE_HZ) == 0)]
            if sent.size:
                samples = encode_samples(Batch(first, sent, CHANNELS, RATE_HZ, epoch=7), sequence=turns[n] % 2**32)
                with suppress(OSError):  # livebode has ended
                    links[n].sendall(samples)
            turns[n] += 1
    page.join()


def look_on(url: str, end: Flag) -> None:
    """What the page takes in."""
    address = url.replace("http", "ws", 1).rstrip("/") + "/live"
    with connect(address, origin=url.rstrip("/"), max_size=None) as link:  # type: ignore[arg-type]
        while not end.is_set():
            try:
                link.recv(timeout=1.0)
            except TimeoutError:
                continue
            except ConnectionClosed:
                return


def resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def measured(hours: float, *, as_live: bool = False) -> Curve:
    """A soak of so many hours of the machine."""
    batch = round((AT_ONCE_AS_LIVE_S if as_live else AT_ONCE_S) * RATE_HZ)
    if not as_live:
        segmented._PIECE_S = segmented._INTERVAL_S = AT_ONCE_S
    context = multiprocessing.get_context("spawn")
    end, done = context.Event(), [context.Value("q", 0) for _ in range(AXES)]
    listeners = [socket.create_server(("127.0.0.1", 0)) for _ in range(AXES)]
    ports = [listener.getsockname()[1] for listener in listeners]
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    names = [f"x{i}" for i in range(AXES)]
    subscribers = {name: (dashboard.hub(name), Progress(one)) for name, one in zip(names, done)}
    with tempfile.TemporaryDirectory() as folder, dashboard:
        beside = context.Process(target=machines, args=(listeners, done, batch, dashboard.url, end))
        session = Session(
            {name: axis(port, fitted=name == names[0]) for name, port in zip(names, ports)},
            lambda name, _: Destination(Path(folder) / name, lambda *_: None, subscribers=subscribers[name]),
            report=lambda *_: None,
            leave=lambda *_: None,
        )
        beside.start()
        try:
            return _followed(session, hours)
        finally:
            end.set()
            beside.join()


def _followed(session: Session, hours: float) -> Curve:
    curve, began, asked = Curve(), time.monotonic(), float("nan")

    def look() -> None:
        nonlocal asked
        now_h = min(thread.status.samples for thread in session.all) / RATE_HZ / 3600
        if now_h >= (curve.hours[-1] if curve.hours else 0.0) + EVERY_S / 3600:
            curve.hours.append(now_h)
            curve.resident_mb.append(resident_mb())
            if len(curve.hours) % 20 == 0:
                took_s = time.monotonic() - began
                print(f"  {now_h:6.2f} h  {curve.resident_mb[-1]:7.1f} MB  {took_s:7.0f} s", flush=True)
        if (now_h >= hours or session.ended_by) and np.isnan(asked):
            asked = time.monotonic()
            session.end()

    session.run(look)
    curve.stop_s, curve.took_s = time.monotonic() - asked, asked - began
    for thread in session.all:
        summary = thread.result().summary
        curve.lost += summary["source"]["counts"]["overflow"]
        curve.responses += summary["counts"]["responses"]
        curve.fits += sum(summary.get("fit", {}).get("statuses", {}).values())
    return curve


def draw(curve: Curve, path: Path) -> None:
    facts = (
        f"{AXES} axes at {RATE_HZ / 1e3:g} kHz, 20 responses/s each, record, one fitted, page open; "
        f"{curve.hours[-1]:.1f} h, slope {curve.slope_mb_per_h:.1f} MB/h"
    )
    with figure_of("Memory of a live process", facts, (8.0, 4.2)) as figure:
        axes = figure.subplots()
        axes.plot(curve.hours, curve.resident_mb, color=LIGHT.run, linewidth=1.2)
        axes.set_ylim(0, 1.25 * max(curve.resident_mb))
        axes.set_xlim(0, curve.hours[-1])
        axes.set_xlabel("hours of the machine")
        axes.set_ylabel("resident memory, MB")
    figure.savefig(path, metadata={"Software": None})


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m studies.soak", description=__doc__)
    parser.add_argument("--hours", type=float, default=24.0, help="of the machine")
    parser.add_argument("--image", type=Path, default=IMAGE)
    parser.add_argument("--as-live", action="store_true", help="with the intervals of a live run: a third of the speed")
    asked = parser.parse_args()
    curve = measured(asked.hours, as_live=asked.as_live)
    slope = curve.slope_mb_per_h
    met = "met" if slope <= MB_PER_H_MAX else "missed"
    print(f"{curve.hours[-1]:.2f} h of the machine in {curve.took_s:.0f} s, {curve.speed:.1f} times its speed")
    print(f"{curve.responses} responses, {curve.responses / AXES:.0f} of one axis, {curve.fits} of them fitted")
    print(f"resident at the end   {curve.resident_mb[-1]:8.1f} MB, at most {max(curve.resident_mb):.1f} MB")
    print(f"slope                 {slope:8.2f} MB/h, target ≤ {MB_PER_H_MAX:g}: {met}")
    print(f"stop                  {curve.stop_s:8.2f} s")
    print(f"samples dropped by a full queue: {curve.lost} spans")
    draw(curve, asked.image)


if __name__ == "__main__":
    main()
