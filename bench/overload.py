"""`python -m bench.overload`: a live run whose model does not fit, at 200 responses per second.

A sender in another process sends 4 kHz over UDP in batches of 25 ms, as a drive would. `two-mass-gain` is fitted to a
delay, which it does not describe, at a hop of 20 samples: each fit is scanned again and fails. The output: lost
samples, longest backlog, number of fitted responses, lines and groups of events, and duration of the end.
"""

from __future__ import annotations

import argparse
import multiprocessing
import socket
import tempfile
import threading
import time
from contextlib import suppress
from pathlib import Path

import numpy as np

from bench.job import LINES, RATE_HZ, WINDOW
from livebode.configuration import Axis
from livebode.core import Channel
from livebode.excitation import multisine
from livebode.records import RunRecord, event_counts
from livebode.runtime import Destination, Document, RunControl, TrackerResults, run
from livebode.sources.live import Batch, encode_layout, encode_samples

CHANNELS = (Channel("w", "N m"), Channel("u", "A"), Channel("y", "rad/s"))
BATCH, PERIODS = 100, 100


class Backlog:
    """The longest backlog of a run."""

    def __init__(self, control: RunControl) -> None:
        self.longest_s = 0.0
        self._control = control

    def __call__(self, document: Document) -> None:
        if isinstance(document, TrackerResults) and self._control.source is not None:
            self.longest_s = max(self.longest_s, self._control.source.waiting_s)


def send(port: int, seconds: float) -> None:
    """Send the data of a drive at its rate."""
    rng = np.random.default_rng(0)
    w = np.resize(multisine(LINES), PERIODS * WINDOW)
    u = w + 0.1 * rng.standard_normal(w.size)
    data = np.array([w, u, np.roll(u, 3) + 0.1 * rng.standard_normal(w.size)])
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.connect(("127.0.0.1", port))
    began = time.monotonic()
    for turn in range(round(seconds * RATE_HZ / BATCH)):
        time.sleep(max(0.0, began + turn * BATCH / RATE_HZ - time.monotonic()))
        at = turn * BATCH % data.shape[1]
        batch = Batch(turn * BATCH, data[:, at : at + BATCH], CHANNELS, float(RATE_HZ), epoch=7)
        with suppress(ConnectionRefusedError):  # the receiver does not listen yet
            if turn % 40 == 0:
                link.send(encode_layout(CHANNELS, float(RATE_HZ), epoch=7))
            link.send(encode_samples(batch, sequence=turn))


def measured(seconds: float, folder: Path) -> dict[str, float]:
    """Results of one run."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", 0))
        port = link.getsockname()[1]
    axis = Axis.of(
        {
            "source": {"url": f"udp://127.0.0.1:{port}"},
            "signals": {"excitation": "w", "input": "u", "output": "y"},
            "lines": {"frequencies": ",".join(f"k={k}" for k in LINES.bins), "window": WINDOW},
            "tracking": {"hop": 20},
            "fit": {"model": "two-mass-gain", "output": "velocity"},
        },
        "overload",
    )
    control = RunControl()
    backlog = Backlog(control)
    to = Destination(folder, lambda *_: None, subscribers=(backlog,))
    running = threading.Thread(target=run, args=(axis, to, control))
    sender = multiprocessing.get_context("spawn").Process(target=send, args=(port, seconds))
    running.start()
    sender.start()
    sender.join()
    assert control.source is not None
    asked, waited_s = time.monotonic(), control.source.waiting_s
    control.end()
    running.join()
    stop_s, found = time.monotonic() - asked, RunRecord.open(folder)
    events = found.events()
    return {
        "samples": found.summary["counts"]["samples"],
        "samples lost": found.summary["source"]["lost"],
        "longest backlog, s": backlog.longest_s,
        "responses": found.summary["counts"]["responses"],
        "of them fitted": sum(found.summary["fit"]["statuses"].values()),
        "lines of events": len(events),
        "groups of events": len({event.details.get("group", id(event)) for event in events}),
        "events": sum(event_counts(event).total() for event in events),
        "backlog at the end, s": waited_s,
        "stop, s": stop_s,
    }


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.overload", description=__doc__)
    parser.add_argument("--seconds", type=float, default=150.0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for label, value in measured(asked.seconds, Path(folder) / "run").items():
            print(f"{label:24}{value:12.4g}" if isinstance(value, float) else f"{label:24}{value:12,}")


if __name__ == "__main__":
    main()
