"""Simulated machines that are tracked while a dashboard shows them."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from livebode.configuration.axis import FitSection
from livebode.core import Block, Channel, Lines
from livebode.dashboard import Hub
from livebode.estimation import Settings, Tracker, plant_kinds
from livebode.excitation import MatrixExcitation, multisine
from livebode.monitoring import Baseline, Monitor
from livebode.runtime import ChangeDetection, Destination, Feed, Fits, RunLoop, SingleResponse
from livebode.runtime._demo import RATE_HZ, demo_axis, described_loop
from livebode.simulation import (
    BeltAxis,
    Friction,
    GantryLoop,
    Sensor,
    SimulatedAxis,
    Standstill,
    TensionLoss,
    TwoMassLoop,
)

Afterwards = Literal["live", "silent", "over"]
BLOCK = 400
_PATIENCE_S = 120.0
_PARAMETERS = 4  # of the fitted model
_AXIS = """
[source]
log = "log.parquet"
rate_hz = 4000
[signals]
output = "y"
input = "u"
excitation = "w"
[lines]
frequencies = "4:100:2, 104:400:8"
window = 2000
[tracking]
hop = 500
[loop.velocity]
gain = 0.2308
integral_time_s = 0.2
rate_hz = 4000
[loop.position]
gain = 1.0
rate_hz = 2000
rate_divider = 2
[fit]
model = "two-mass"
output = "velocity"
radius_m = 0.019
"""
_GANTRY = """
[source]
log = "log.parquet"
rate_hz = 4000
[signals]
output = ["velocity1", "velocity2"]
input = ["u1", "u2"]
excitation = ["w1", "w2"]
[lines]
frequencies = "6:60:2, 64:120:4"
window = 2000
[tracking]
estimator = "joint"
hop = 2000
[experiments]
dwell_periods = 3
settle_periods = 2
"""


@dataclass
class Held:
    """The first seconds of a simulated axis as fast as possible; afterwards it is live, silent or over."""

    machine: SimulatedAxis
    fast_s: float
    afterwards: Afterwards

    def __post_init__(self) -> None:
        self.reached, self.left = threading.Event(), threading.Event()

    @property
    def channels(self) -> tuple[Channel, ...]:
        return self.machine.channels

    @property
    def samples(self) -> None:
        """Not known before its end, as of a live source."""

    def blocks(self, channels: Sequence[str], block_samples: int = BLOCK) -> Iterator[Any]:
        """Blocks, and None while the machine sends nothing."""
        begun_s = time.monotonic()
        for block in self.machine.blocks(channels, block_samples):
            now_s = block.stop / RATE_HZ
            if now_s > self.fast_s:
                if not self.reached.is_set():
                    self.reached.set()
                    begun_s = time.monotonic() - now_s
                yield from self._wait(begun_s + now_s)
                if self.left.is_set():
                    return
            yield block

    def _wait(self, until_s: float) -> Iterator[Block | None]:
        while self.afterwards != "over" and not self.left.wait(0.02):
            if self.afterwards == "live" and time.monotonic() >= until_s:
                return
            yield None
        self.left.set()


class Tracked:
    """A run of a machine, in a thread of its own, until it is left; in the context its fast part is over."""

    def __init__(
        self, held: Held, settings: Settings, to: Path, hub: Hub | None = None, baseline: Baseline | None = None
    ) -> None:
        drive = held.machine.axis.drive
        fit, loop = FitSection(radius_m=held.machine.axis.mechanics.radius_m), described_loop(drive)
        enough = len(settings.lines) > _PARAMETERS
        pipeline = SingleResponse(
            Tracker(settings),
            Fits(fit, loop.build(RATE_HZ), plant_kinds(held.channels, settings)) if enough else None,
            None if baseline is None else ChangeDetection(Monitor(baseline, settings), "healthy strokes"),
        )
        configuration = {"loop": loop.model_dump(mode="json")} | ({"fit": fit.model_dump()} if enough else {})
        about = {"configuration": configuration, "found": {"clock": "relative"}}
        destination = Destination(to, lambda *_: None, subscribers=() if hub is None else (hub,))
        run = RunLoop(Feed(held, block_samples=BLOCK), pipeline, destination, about=about)
        self._held = held
        self._thread = threading.Thread(target=run.run)

    def __enter__(self) -> Self:
        self._thread.start()
        end_s = time.monotonic() + _PATIENCE_S
        while self._thread.is_alive() and not self._held.reached.wait(0.05):
            if time.monotonic() > end_s:
                raise TimeoutError("the simulated machine is too slow")
        return self

    def __exit__(self, *_: object) -> None:
        if self._held.afterwards != "over":
            self._held.left.set()
        self._thread.join()


def healthy(afterwards: Afterwards, fast_s: float = 20.0) -> Held:
    """The demo's axis without a fault."""
    return Held(SimulatedAxis(demo_axis(3600.0, 1)), fast_s, afterwards)


def at_standstill(lines: Lines, amplitude_n_m: float) -> tuple[Held, Settings]:
    """Six seconds of an axis at standstill, excited at these lines, and how it is tracked."""
    axis = BeltAxis(
        motion=Standstill(position_m=0.9),
        excitation_n_m=multisine(lines, amplitude_n_m),
        sensor=Sensor(noise_rad_per_s=0.05),
        seconds=6.0,
    )
    settings = Settings(lines=lines, output="velocity", input="u", excitation="w", schedule="x", hop=lines.window // 4)
    return Held(SimulatedAxis(axis), 6.0, "over"), settings


def drifting() -> tuple[Held, Settings]:
    """Twelve seconds of a belt with friction that loses 10 % of its stiffness, and how it is averaged."""
    excited = tuple(k for k in range(15, 125, 2) if k % 8 != 3)  # odd bins; every fourth is a detection line
    lines = Lines(excited, 3200, RATE_HZ, tuple(set(range(15, 125)) - set(excited)))
    axis = BeltAxis(
        motion=Standstill(position_m=0.8),
        friction=Friction(motor_coulomb_n_m=0.02),
        excitation_n_m=multisine(lines),
        sensor=Sensor(noise_rad_per_s=1.0),
        faults=(TensionLoss(loss=0.1, ramp_s=12.0),),
        seconds=12.0,
    )
    settings = Settings(lines=lines, output="velocity", input="u", excitation="w", hop=800, average=True)
    return Held(SimulatedAxis(axis), 12.0, "over"), settings


def write_loop(folder: Path) -> Path:
    """A recording of two masses in their loop at standstill, and the axis.toml that describes it, which is returned."""
    lines = Lines.parse("4:100:2, 104:400:8", RATE_HZ, 2000)
    w = 0.1 * multisine(lines)
    u, y = TwoMassLoop().run(w, 10, sigma=0.1, seed=1)
    return _written(folder, _AXIS, {"w": np.resize(w, u.size), "u": u[0], "y": y[0]})


def write_gantry(folder: Path) -> Path:
    """A recording of a gantry with two motors, and the axis.toml that describes it, which is returned."""
    lines = Lines.parse("6:60:2, 64:120:4", RATE_HZ, 2000)
    excitation = MatrixExcitation.orthogonal(lines, 2, 0.5, dwell=3, settle=2)
    w = np.tile(excitation.samples, 4)
    block = GantryLoop().simulate(w, noise=0.2 * np.random.default_rng(0).standard_normal((3, w.shape[1])))
    return _written(folder, _GANTRY, dict(zip(block.names, block.data)))


def _written(folder: Path, text: str, columns: dict[str, np.ndarray]) -> Path:
    folder.mkdir()
    pq.write_table(pa.table(columns), folder / "log.parquet")
    (folder / "axis.toml").write_text(text, encoding="utf-8")
    return folder / "axis.toml"
