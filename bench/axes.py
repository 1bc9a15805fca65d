"""What an axis costs where one process has many: tracking, fits, monitoring, as shares of a core.

python -m bench.axes

The machine is the simulated tooth-belt axis in motion: three signals at 4 kHz, 7 lines, 20 responses a second, two fits
a second, compared with a baseline with a model of the moving machine. Processor time of the thread; the least of
several rounds.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from livebode.analysis import learn
from livebode.configuration import Axis, open_recording
from livebode.core import Block
from livebode.interface import write_examples
from livebode.preparation import make_follower
from livebode.runtime import Destination, SingleResponse, run
from livebode_plant.fleet.alike_axes import process_together

AXES, ROUNDS = 100, 3
FITS_PER_S = 2
TARGET_PERCENT = 1.0
BLOCKS_MS = (500, 100)


@dataclass
class Spent:
    """Seconds of processor time."""

    seconds: float = 0.0

    @contextmanager
    def counting(self) -> Iterator[None]:
        begun = time.thread_time()
        yield
        self.seconds += time.thread_time() - begun


def machine(folder: Path) -> tuple[Axis, Block]:
    """The configuration with fit and baseline, and the samples of some strokes."""
    write_examples(["fault"], folder)
    for day in ("monday", "tuesday"):
        run(Axis.read(folder / f"{day}.toml"), Destination(folder / day, lambda *_: None))
    learn([folder / "monday", folder / "tuesday"]).save(folder / "healthy.json")
    axis = Axis.read(folder / "today.toml")
    found = axis.model_dump(mode="json", by_alias=True) | {"fit": {"model": "two-mass"}}
    found["tracking"]["hop"] = 200
    found["monitoring"]["baseline"] = str(folder / "healthy.json")
    axis = Axis.of(found, "today.toml")
    log = open_recording(axis)
    pipeline = SingleResponse.of(axis, make_follower(axis, log), log.channels)
    blocks = list(log.blocks(pipeline.channels))
    return axis, replace(blocks[0], data=np.concatenate([block.data for block in blocks], axis=1))


def shares(axis: Axis, every: Block, block_ms: int) -> dict[str, float]:
    """Percent of a core of one axis."""
    log = open_recording(axis)
    pipeline = SingleResponse.of(axis, make_follower(axis, log), log.channels)
    assert pipeline.detection is not None
    assert pipeline.fits is not None
    tracking, monitoring, fits = Spent(), Spent(), Spent()
    samples = round(every.rate_hz * block_ms / 1000)
    apart = round(every.rate_hz / FITS_PER_S)
    for start in range(0, len(every), samples):
        block = replace(every, data=every.data[:, start : start + samples], start=start)
        with monitoring.counting():
            pipeline.detection.take_samples(block)
        with tracking.counting():
            found = pipeline.follower.process(block)
        some = found[np.flatnonzero((found.sample + 1) % apart < pipeline.follower.settings.hop)]
        with fits.counting():
            fitted = pipeline.fits.process(some)[0][0] if len(some) else None
        with monitoring.counting():
            pipeline.detection.take_responses(some, fitted)
    whole_s = len(every) / every.rate_hz
    return {
        "tracking": 100 * tracking.seconds / whole_s,
        "fits, each axis alone": 100 * fits.seconds / whole_s,
        "monitoring": 100 * monitoring.seconds / whole_s,
    }


def fits_together(axis: Axis, every: Block) -> float:
    """Percent of a core of one axis, if the new responses of all axes are fitted at once."""
    log = open_recording(axis)
    tracker = make_follower(axis, log)
    found = tracker.process(every)
    fits = [SingleResponse.of(axis, make_follower(axis, log), log.channels).fits for _ in range(AXES)]
    known = [one for one in fits if one is not None]
    process_together(known, [found[:16]] * AXES)
    spent, calls = Spent(), 10
    for i in range(16, 16 + calls):
        with spent.counting():
            process_together(known, [found[i : i + 1]] * AXES)
    return 100 * FITS_PER_S * spent.seconds / (calls * AXES)


def main() -> None:
    with TemporaryDirectory() as folder:
        axis, every = machine(Path(folder))
        together = min(fits_together(axis, every) for _ in range(ROUNDS))
        for block_ms in BLOCKS_MS:
            rounds = [shares(axis, every, block_ms) for _ in range(ROUNDS)]
            least = {name: min(one[name] for one in rounds) for name in rounds[0]}
            least[f"fits, {AXES} axes at once"] = together
            print(f"blocks of {block_ms} ms")
            for name, percent in least.items():
                print(f"  {name:26}{percent:7.3f} % of a core")
            whole = least["tracking"] + least["monitoring"] + together
            verdict = "met" if whole <= TARGET_PERCENT else "missed"
            print(f"  {'tracking, fits, monitoring':26}{whole:7.3f} %   target ≤ {TARGET_PERCENT:g} %: {verdict}")


if __name__ == "__main__":
    main()
