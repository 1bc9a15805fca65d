"""How many axes of live runs with `[fit]` and `[monitoring]` one core has time for, and what each part costs.

    python -m bench.monitoring_live

Two machines at 4 kHz, as `livebode run` processes their blocks of 25 ms: the axis at standstill with 21 lines,
compared with tables of lines and fitted parameters; and the axis in motion of `bench.axes` with 7 lines, compared with
a model of the moving machine. 200 responses a second are the default at a window of 400 samples. Processor time of the
thread, the least of three rounds, after the fits of the first responses; the record and the dashboard are not part of
it (`python -m bench.live`).

The fits of all axes of a process have half of a core at most (`livebode.runtime.shedding`), and are thinned beyond
that; samples and monitoring are not. The last columns say how many axes there is time for, and how many fits a second
each of 16 axes then has.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from bench.axes import Spent
from bench.axes import machine as moving
from livebode.analysis import learn
from livebode.configuration import Axis, MonitoringSection, open_recording
from livebode.core import Block, Lines
from livebode.excitation import multisine
from livebode.preparation import make_follower
from livebode.runtime import Destination, SingleResponse, run
from livebode.runtime.shedding import SHARE
from livebode.simulation import BeltAxis, Sensor, SimulatedAxis

UNITS = {"u": "N m", "velocity": "rad/s", "w": "N m"}
RATE_HZ, BLOCK_S, ROUNDS = 4000.0, 0.025, 3
HOPS = (20, 200)
WARM_S = 2.0
HEALTHY_S, MEASURED_S = 20.0, 8.0
TARGET_AXES = 16


@dataclass(frozen=True)
class Shares:
    """Parts of a core that one axis needs, and its responses per second."""

    tracking: float
    monitoring: float
    fits: float
    responses_per_s: float

    @property
    def axes(self) -> float:
        """Axes that one core has time for, with fits of all responses or in the half of the core that they have."""
        without_fits = self.tracking + self.monitoring
        return min(max(1 / (without_fits + self.fits), (1 - SHARE) / without_fits), 1 / without_fits)

    def fits_per_s(self, axes: int) -> float:
        """Of each of so many axes."""
        return self.responses_per_s * min(1.0, SHARE / (axes * self.fits))


def standing(folder: Path) -> tuple[Axis, Block]:
    """The axis at standstill with 21 lines, and its samples."""
    healthy, _ = recorded(folder / "healthy", HEALTHY_S, seed=1)
    run(healthy, Destination(folder / "healthy", lambda *_: None))
    learn([folder / "healthy"]).save(folder / "standing.json")
    axis, block = recorded(folder / "still", MEASURED_S, seed=2)
    return axis.model_copy(update={"monitoring": MonitoringSection(baseline=folder / "standing.json")}), block


def recorded(path: Path, seconds: float, seed: int) -> tuple[Axis, Block]:
    """A recording of the axis at standstill: its configuration and its samples."""
    excitation_n_m = multisine(Lines.parse("20:220:10", rate_hz=RATE_HZ, window=400), 0.3)
    sensor = Sensor(noise_rad_per_s=0.05)
    axis = BeltAxis(excitation_n_m=excitation_n_m, sensor=sensor, run_in_s=0.5, seconds=seconds, seed=seed)
    block, _ = SimulatedAxis(axis).run()
    block = replace(block, data=block.data[[block.index(name) for name in UNITS]], channels=tuple(UNITS))
    columns = {f"{name} [{unit}]": block[name] for name, unit in UNITS.items()}
    pq.write_table(pa.table(columns), path.with_suffix(".parquet"))
    return (
        Axis.of(
            {
                "source": {"log": str(path.with_suffix(".parquet")), "rate_hz": RATE_HZ},
                "signals": {"output": "velocity", "input": "u", "excitation": "w"},
                "lines": {"frequencies": "20:220:10", "window": 400},
                "fit": {"model": "two-mass"},
            },
            path.name,
        ),
        block,
    )


def at_hop(axis: Axis, hop: int) -> Axis:
    """The same axis with another rate of responses."""
    return axis.model_copy(update={"tracking": axis.tracking.model_copy(update={"hop": hop})})


def blocks(every: Block) -> Iterator[Block]:
    """The samples as they arrive."""
    samples = round(every.rate_hz * BLOCK_S)
    for start in range(0, len(every) - samples + 1, samples):
        yield replace(every, data=every.data[:, start : start + samples], start=start)


def shares(axis: Axis, every: Block) -> Shares:
    """What one axis costs, in the order of a live run."""
    log = open_recording(axis)
    pipeline = SingleResponse.of(axis, make_follower(axis, log), log.channels)
    detection, fits = pipeline.detection, pipeline.fits
    assert detection is not None
    assert fits is not None
    tracking, monitoring, fitting = Spent(), Spent(), Spent()
    responses, first = 0, None
    for block in blocks(every):
        if first is None and block.start >= WARM_S * every.rate_hz:
            first, tracking, monitoring, fitting, responses = block.start, Spent(), Spent(), Spent(), 0
        with monitoring.counting():
            detection.take_samples(block)
        with tracking.counting():
            found = pipeline.follower.process(block)
        with fitting.counting():
            fitted = fits.process(found)[0][0]
        with monitoring.counting():
            detection.take_responses(found, fitted)
        responses += len(found)
    assert first is not None
    assert detection.judges
    seconds = (block.stop - first) / every.rate_hz
    return Shares(tracking.seconds / seconds, monitoring.seconds / seconds, fitting.seconds / seconds,
                  responses / seconds)  # fmt: skip


def least(axis: Axis, every: Block) -> Shares:
    """Of several rounds."""
    rounds = [shares(axis, every) for _ in range(ROUNDS)]
    names = ("tracking", "monitoring", "fits", "responses_per_s")
    return Shares(*(min(getattr(one, name) for one in rounds) for name in names))


def main() -> None:
    """Print the table."""
    titles = ("machine", "responses/s", "tracking", "monitoring", "fit of every response", "axes a core",
              "fits/s each of 16")  # fmt: skip
    print("| " + " | ".join(titles) + " |\n" + "|---" * len(titles) + "|")
    with TemporaryDirectory() as folder:
        machines = {"at standstill, 21 lines": standing(Path(folder)), "in motion, 7 lines": moving(Path(folder))}
        fewest = np.inf
        for name, (axis, every) in machines.items():
            for hop in HOPS:
                found = least(at_hop(axis, hop), every)
                fewest = min(fewest, found.axes)
                percent = " | ".join(f"{100 * x:.2f} %" for x in (found.tracking, found.monitoring, found.fits))
                last = f"{found.axes:.0f} | {found.fits_per_s(TARGET_AXES):.1f}"
                print(f"| {name} | {found.responses_per_s:.0f} | {percent} | {last} |")
    verdict = "met" if fewest >= TARGET_AXES else "missed"
    print(f"axes a core: {fewest:.0f} or more, target ≥ {TARGET_AXES}: {verdict}")


if __name__ == "__main__":
    main()
