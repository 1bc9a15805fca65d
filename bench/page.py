"""The page of a live run over a slow link: requests, bytes and seconds to the first curve.

    python -m bench.page [--latency-ms 150] [--rounds 5]

A headless Chromium opens the page with the bundle (`make bundle`) and with its files one by one: a first visit, and a
second one, when it has stored what it may. The latency is added to every request, by Chromium itself. Printed are the
most requests and bytes until the first curve is drawn, and the least seconds: other processes use the same cores. A web
socket is a request; its messages are not in the bytes.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from bench.browser import chromium
from bench.dashboard import RATE_HZ, WINDOW, publish, responses
from livebode.analysis import Overview
from livebode.core import Lines
from livebode.dashboard import Dashboard, ServerSettings, static_files
from livebode.runtime import RunControl, RunStarted

REQUESTS_MAX, SECONDS_MAX = 8, 1.5
# Once the Bode plot is drawn with a curve, in milliseconds since the navigation began.
_DRAWN = """
window.drawn_ = new Promise((done) => {
  const look = () => {
    const bode = window.livebode?.bode;
    if (bode?.curves.measured && bode.charts.length) requestAnimationFrame(() => done(performance.now()));
    else requestAnimationFrame(look);
  };
  look();
});
"""


class Visit(NamedTuple):
    """What one opening of the page took until its first curve."""

    requests: int
    kilobytes: float
    seconds: float


def visit(context: Any, url: str, latency_ms: float) -> Visit:
    """Open the page in a new tab."""
    page = context.new_page()
    network = context.new_cdp_session(page)
    sent, stored, sizes = set[str](), set[str](), list[float]()

    def received(event: dict[str, Any]) -> None:
        if event["response"].get("fromDiskCache"):
            stored.add(event["requestId"])

    network.on("Network.requestWillBeSent", lambda event: sent.add(event["requestId"]))
    network.on("Network.webSocketCreated", lambda event: sent.add(event["requestId"]))
    network.on("Network.requestServedFromCache", lambda event: stored.add(event["requestId"]))
    network.on("Network.responseReceived", received)
    network.on("Network.loadingFinished", lambda event: sizes.append(event["encodedDataLength"]))
    network.send("Network.enable")
    limits = {"offline": False, "latency": latency_ms, "downloadThroughput": -1, "uploadThroughput": -1}
    network.send("Network.emulateNetworkConditions", limits)
    page.goto(url, wait_until="commit")
    seconds = page.evaluate("() => window.drawn_") / 1e3
    found = Visit(len(sent - stored), sum(sizes) / 1e3, seconds)
    page.close()
    return found


@contextmanager
def live_page() -> Iterator[str]:
    """The address of a page with responses of 101 lines, 30 times a second."""
    dashboard, stop = Dashboard(ServerSettings("127.0.0.1", 0)), threading.Event()
    hub, lines = dashboard.hub("bench"), Lines(tuple(range(5, 106)), WINDOW, RATE_HZ)
    found = {
        "bins": list(lines.bins), "quiet_bins": [], "window": WINDOW, "rate_hz": RATE_HZ, "quantity": "plant",
        "unit": "rad/s/(N m)", "schedule": "x in m",
    }  # fmt: skip
    loop = {"velocity": {"gain": 0.2, "integral_time_s": 0.2, "rate_hz": RATE_HZ}}
    with tempfile.TemporaryDirectory() as folder, dashboard:
        hub(RunStarted(Path(folder), {"found": found, "configuration": {"loop": loop}}, RunControl(), Overview()))
        worker = threading.Thread(target=publish, args=(hub, responses(lines, 64, 0), stop, []))
        worker.start()
        try:
            time.sleep(1)  # there are responses
            yield dashboard.url
        finally:
            stop.set()
            worker.join()


def measured(browser: Any, latency_ms: float, rounds: int) -> list[Visit]:
    """The most requests and bytes and the least seconds, of first and of second visits."""
    visits: list[list[Visit]] = [[], []]
    with live_page() as url:
        for _ in range(rounds):
            context = browser.new_context(viewport={"width": 1440, "height": 900})
            context.add_init_script(_DRAWN)
            for of_kind in visits:
                of_kind.append(visit(context, url, latency_ms))
            context.close()
    return [
        Visit(
            max(one.requests for one in of_kind),
            max(one.kilobytes for one in of_kind),
            min(one.seconds for one in of_kind),
        )
        for of_kind in visits
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--latency-ms", type=float, default=150.0)
    parser.add_argument("--rounds", type=int, default=5)
    asked = parser.parse_args()
    bundle = static_files.BUNDLE
    if not (bundle / "manifest.json").is_file():
        raise SystemExit("there is no bundle: make bundle")
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}; latency {asked.latency_ms:g} ms")
    with chromium() as browser:
        for name, place in (("bundle", bundle), ("files one by one", bundle / "absent")):
            static_files.BUNDLE = place
            for kind, found in zip(("first", "second"), measured(browser, asked.latency_ms, asked.rounds)):
                line = f"{found.requests:4} requests {found.kilobytes:6.0f} kB {found.seconds:5.2f} s"
                met = {True: "met", False: "missed"}[found.requests <= REQUESTS_MAX and found.seconds <= SECONDS_MAX]
                verdict = f"  target ≤ {REQUESTS_MAX}, ≤ {SECONDS_MAX:g} s: {met}" if name == "bundle" else ""
                print(f"{name:17}{kind:7} visit{line}{verdict}")


if __name__ == "__main__":
    main()
