"""A machine whose run goes on as far as a test lets it, with the dashboard open."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from livebode.analysis import Overview
from livebode.configuration import FitSection, LoopSection, RecordSection
from livebode.core import Block, Channel, Lines, Responses
from livebode.dashboard import Dashboard, Hub, ServerSettings
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine
from livebode.records import RunRecord
from livebode.runtime import Fits, RunControl, RunStarted
from livebode.simulation import TwoMassLoop
from livebode.simulation.two_mass_loop import RATE_HZ
from tests.support.browser import until
from tests.support.peers.peer import PATIENCE_S
from tests.support.responses import made
from tests.support.runs import record

LINES = Lines.parse("20:140:10", RATE_HZ, 400)
UNITS = {"w": "N m", "u": "N m", "y": "rad/s", "x": "m"}
SETTINGS = Settings(lines=LINES, output="y", input="u", excitation="w", schedule="x", hop=40)
LOOP = {
    "velocity": {"gain": 0.2308, "integral_time_s": 0.2, "rate_hz": RATE_HZ},
    "position": {"gain": 1.0, "rate_hz": RATE_HZ / 2, "rate_divider": 2},
}
FIT = {"model": "two-mass", "output": "velocity", "radius_m": 0.019}
SAMPLES = 12_000
BAD = 5000  # a sample that is not finite: an event, and responses that are not valid


@cache
def data() -> np.ndarray:
    """w, u, y and a position that goes there and back, shape (4, samples)."""
    w = 0.3 * multisine(LINES)
    u, y = TwoMassLoop().run(w, SAMPLES // LINES.window, sigma=0.1, seed=1)
    x = 0.9 + 0.6 * np.sin(2 * np.pi * np.arange(SAMPLES) / 8000)
    found = np.array([np.resize(w, SAMPLES), u[0], y[0], x])
    found[2, BAD] = np.nan
    return found


class Machine:
    """Hands out its samples as far as `allow` says."""

    samples = None

    def __init__(self) -> None:
        self._allowed = 0
        self._more = threading.Condition()

    @property
    def channels(self) -> tuple[Channel, ...]:
        return tuple(Channel(name, unit) for name, unit in UNITS.items())

    def allow(self, samples: int) -> None:
        with self._more:
            self._allowed = samples
            self._more.notify_all()

    def blocks(self, channels: Sequence[str]) -> Iterator[Block | None]:
        rows = [list(UNITS).index(name) for name in channels]
        for start in range(0, SAMPLES, 200):
            with self._more:
                while self._allowed < start + 200:
                    self._more.wait(0.05)
                    if self._allowed >= start + 200:
                        break
                    if self._allowed < 0:
                        return
                    yield None
            yield Block(data()[rows, start : start + 200], tuple(channels), RATE_HZ, start=start)


class Watched:
    """A run in segments that the dashboard shows; `serving` says to whom."""

    def __init__(
        self,
        directory: Path,
        serving: ServerSettings | None = None,
        loop: dict[str, Any] | None = LOOP,
        name: str = "axis",
        samples: bool = False,
    ) -> None:
        self.directory, self.machine = directory, Machine()
        self.messages: list[str] = []
        self.dashboard = Dashboard(serving or ServerSettings("127.0.0.1", 0), self.messages.append)
        self.hub = self.dashboard.hub(name)
        words = {"loop": loop or {}, "fit": FIT, "signals": {"output": "y", "input": "u", "schedule": "x"}}
        section = FitSection.model_validate(FIT)
        described = LoopSection.model_validate(loop or {}).build(RATE_HZ)
        self._thread = threading.Thread(
            target=record,
            args=(self.machine, Tracker(SETTINGS), directory),
            kwargs={
                "about": {"configuration": words, "found": {"format": "test"}}, "subscribers": [self.hub],
                "fits": Fits(section, described if loop else None),
                "segments": RecordSection(segment_s=1.0, samples=samples),
            },
        )  # fmt: skip

    def __enter__(self) -> Watched:
        self.dashboard.__enter__()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.end()
        self.dashboard.__exit__()

    @property
    def url(self) -> str:
        return self.dashboard.url

    def go(self, samples: int) -> None:
        """Let the machine go on to this sample, and wait until all of it is published."""
        self.machine.allow(samples)
        until(lambda: self.hub.samples >= samples or not self._thread.is_alive(), f"sample {samples}")

    def end(self) -> None:
        """Let the run end."""
        self.machine.allow(-1 if self.hub.samples < SAMPLES else SAMPLES)
        self._thread.join(PATIENCE_S)
        assert not self._thread.is_alive()

    def record(self) -> RunRecord:
        """What is recorded by now."""
        return RunRecord.open(self.directory)


def whole_run(directory: Path, loop: dict[str, Any] | None = LOOP) -> Path:
    """The directory of a run that is over."""
    with Watched(directory, loop=loop) as run:
        run.go(SAMPLES)
    return directory


def begin(hub: Hub, directory: Path, lines: Lines, from_s: float = 0.0, rows: Responses | None = None) -> None:
    """A run on these lines, with its first responses, that begins at this time."""
    found = {"bins": list(lines.bins), "quiet_bins": [], "window": lines.window, "rate_hz": lines.rate_hz}
    found |= {"quantity": "plant", "unit": ""}
    overview = Overview()
    hub(RunStarted(directory, {"found": found, "configuration": {"loop": LOOP}}, RunControl(), overview))
    rows = rows or made(30, lines, hole=0.0, unit="")
    rows = replace(rows, time_s=rows.time_s + from_s)
    overview.add(rows)
    hub(rows)
