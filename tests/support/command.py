"""Runs the command line in this process, and makes recordings for it."""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

import numpy as np

from livebode.cli import main
from livebode.core import Lines
from livebode.excitation import multisine

RATE_HZ, WINDOW = 1000, 100
LINES = Lines.parse("50,100,200", RATE_HZ, WINDOW)


@dataclass(frozen=True)
class Result:
    code: int
    out: str
    err: str


def livebode(*arguments: object) -> Result:
    """`livebode` with these arguments, as its entry point would be called."""
    out, err, code = io.StringIO(), io.StringIO(), 0
    with (
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        mock.patch.object(sys, "argv", ["livebode", *map(str, arguments)]),
    ):
        try:
            main()
        except SystemExit as stop:
            code = int(stop.code or 0)
    return Result(code, out.getvalue(), err.getvalue())


def signals(samples: int = 2000, noise: float = 0.01, seed: int = 0) -> dict[str, np.ndarray]:
    """A plant of gain 2 behind one sample of delay, driven by a multisine at 50, 100 and 200 Hz, in periodic state."""
    rng = np.random.default_rng(seed)
    period = multisine(LINES)
    w = np.resize(period, samples)
    u = w + noise * rng.standard_normal(samples)
    y = 2 * np.concatenate([period[-1:], u[:-1]]) + noise * rng.standard_normal(samples)
    return {"t": np.arange(samples) / RATE_HZ, "w": w, "u": u, "y": y}


def write_parquet(path: Path, columns: Mapping[str, np.ndarray]) -> Path:
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table({name: pa.array(values) for name, values in columns.items()}), path)
    return path


def write_csv(path: Path, columns: Mapping[str, np.ndarray]) -> Path:
    rows = [",".join(columns), *(",".join(map(repr, map(float, row))) for row in zip(*columns.values()))]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path
