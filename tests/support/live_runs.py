"""`livebode run` in a process of its own, and the tables of its record."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa

from livebode.core import Channel
from livebode.records import RunRecord
from livebode.sources.live import Batch
from tests.support.command import RATE_HZ, signals
from tests.support.forked import Command
from tests.support.small_axis import SMALL_AXIS

CHANNELS = (Channel("w", "A"), Channel("u", "A"), Channel("y", "rad/s"))


def sent(samples: int = 2000, size: int = 40, first: int = 70_000) -> list[Batch]:
    columns = signals(samples)
    data = np.array([columns[name] for name in "wuy"])
    return [
        Batch(first + at, data[:, at : at + size].copy(), CHANNELS, float(RATE_HZ), 9) for at in range(0, samples, size)
    ]


def axis(folder: Path, source: str, rest: str = SMALL_AXIS) -> Path:
    path = folder / "axis.toml"
    path.write_text(f"[source]\n{source}\n{rest}")
    return path


def started(path: Path, out: Path) -> Command:
    """The process of this run; it does not outlive the test, also where a wait for it times out."""
    return Command("run", path, "--out", out, "--json")


def table(out: Path, what: str = "responses") -> dict[str, np.ndarray]:
    table = pa.concat_tables(map(pa.table, RunRecord.open(out).tables(what)))
    return {
        name: np.array(column.to_pylist(), _dtype(column)) for name, column in zip(table.column_names, table.columns)
    }


def _dtype(column: pa.ChunkedArray) -> type | None:
    return np.float32 if column.type == pa.float32() else None


def assert_recorded(live: dict[str, np.ndarray], recorded: dict[str, np.ndarray], *, but: Sequence[str] = ()) -> None:
    """The run of a recording has the values of the live run, what describes their accuracy in single precision."""
    for name in recorded.keys() - {*but}:
        np.testing.assert_array_equal(live[name].astype(recorded[name].dtype), recorded[name], err_msg=name)
