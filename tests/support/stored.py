"""`python -m tests.support.stored FOLDER`: writes the stored runs of a format version; see the README next to them."""

from __future__ import annotations

import hashlib
import json
import shutil
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from livebode.configuration import Axis, RecordSection
from livebode.core import Block, Lines, Responses
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine
from livebode.records import last_commit
from livebode.runtime import Destination, run
from tests.support.command import write_parquet
from tests.support.recorded import NAMES, Machine
from tests.support.runs import record

RATE_HZ, SAMPLES, BLOCK, ENDS_AT = 400.0, 1000, 50, 700
LINES = Lines.parse("40,100", RATE_HZ, 20)
KEPT = RecordSection(samples=True, segment_s=1.0)
SETTINGS = Settings(lines=LINES, output="y", input="u", excitation="w", schedule="t", hop=20)
ARRAYS = ("first", "sample", "time_s", "schedule", "value", "sigma", "dof", "coherence", "valid", "weight")


def data() -> np.ndarray:
    """w, u, y, t with a sample that is not finite, shape (4, samples)."""
    w = np.round(np.tile(multisine(LINES), SAMPLES // LINES.window) * 64) / 64
    y = np.roll(np.cumsum(w), 1) / 16 + np.round(np.sin(np.arange(SAMPLES) ** 2)) / 64
    y[300] = np.nan
    return np.array([w, w, y, np.arange(SAMPLES) / RATE_HZ])


class Source(Machine):
    """The same at a low rate, so that little is stored."""

    def blocks(self, channels: Sequence[str]) -> Iterator[Block]:
        for block in super().blocks(channels):
            yield Block(block.data, block.channels, RATE_HZ, start=block.start)


def in_segments(folder: Path) -> None:
    """An unfinished run: a closed segment of each table, a journal, events."""

    def end(sample: int) -> None:
        if sample >= ENDS_AT:
            raise KeyboardInterrupt

    source = Source(data(), SAMPLES, BLOCK, end)
    try:
        about = {"configuration": {"record": KEPT.model_dump()}}
        record(source, Tracker(SETTINGS), folder, about=about, segments=KEPT)
    except KeyboardInterrupt:
        return


def in_one_piece(folder: Path, scratch: Path) -> None:
    """A finished run with fits."""
    table = data()[:, :600]
    columns = dict(zip(NAMES, table))
    given = {
        "source": {"log": write_parquet(scratch / "log.parquet", columns)},
        "signals": {"output": "y", "input": "u", "excitation": "w", "schedule": "t"},
        "lines": {"frequencies": "40,100", "window": 20},
        "tracking": {"hop": 20},
        "fit": {"model": "rigid", "output": "velocity"},
    }
    run(Axis.of(given, "stored"), Destination(folder, lambda *_: None))


def content(responses: Responses) -> dict[str, str]:
    """SHA-256 of each array, little-endian."""
    return {name: digest(getattr(responses, name)) for name in ARRAYS}


def digest(array: np.ndarray) -> str:
    """SHA-256 of its elements, in order."""
    return hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()


def write(folder: Path) -> None:
    from tests.support.stateful_cases import baseline

    folder.mkdir()
    in_segments(folder / "segments")
    in_one_piece(folder / "piece", folder)
    (folder / "log.parquet").unlink()
    baseline(by_model=True).save(folder / "baseline.json")
    tracked = Tracker(SETTINGS).process(Block(data(), NAMES, RATE_HZ))
    commit = last_commit(folder / "segments")
    assert commit is not None
    expected = {
        "responses": content(tracked[tracked.sample < commit.sample]),
        "samples": digest(data()[:, : commit.sample]),
    }
    (folder / "expected.json").write_text(json.dumps(expected, indent=1) + "\n")
    for path in folder.rglob("*.png"):
        path.unlink()


if __name__ == "__main__":
    shutil.rmtree(sys.argv[1], ignore_errors=True)
    write(Path(sys.argv[1]))
