"""`livebode run` in a process of its own, and the tables of its record."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa

from livebode.records import RunRecord
from tests.support.forked import Command


def started(path: Path, out: Path, pictures: bool = False) -> Command:
    """The process of this run; it does not outlive the test, also where a wait for it times out."""
    return Command("run", path, "--out", out, "--json", pictures=pictures)


def table(out: Path, what: str = "responses") -> dict[str, np.ndarray]:
    table = pa.concat_tables(map(pa.table, RunRecord.open(out).tables(what)))
    return {name: np.array(column) for name, column in table.to_pydict().items()}
