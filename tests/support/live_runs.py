"""`livebode run` in a process of its own, and the tables of its record."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pyarrow as pa

from livebode.records import RunRecord


@contextmanager
def started(path: Path, out: Path) -> Iterator[subprocess.Popen[bytes]]:
    """The process of this run; it does not outlive the test, also where a wait for it times out."""
    command = [Path(sys.executable).with_name("livebode"), "run", str(path), "--out", str(out), "--json"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe) as process:
        try:
            yield process
        finally:
            process.kill()


def table(out: Path, what: str = "responses") -> dict[str, np.ndarray]:
    table = pa.concat_tables(RunRecord.open(out).tables(what))
    return {name: np.array(column) for name, column in table.to_pydict().items()}
