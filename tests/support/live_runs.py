"""`livebode run` in a process of its own, and the tables of its record."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa

from livebode.records import RunRecord


def started(path: Path, out: Path) -> subprocess.Popen[bytes]:
    command = [Path(sys.executable).with_name("livebode"), "run", str(path), "--out", str(out), "--json"]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def table(out: Path, what: str = "responses") -> dict[str, np.ndarray]:
    table = pa.concat_tables(RunRecord.open(out).tables(what))
    return {name: np.array(column) for name, column in table.to_pydict().items()}
