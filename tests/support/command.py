"""Runs the command line in this process, and makes recordings for it."""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Iterator, Mapping
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


_DRAWN = {
    "design": (
        "livebode_design.excitation_picture.save_excitation_picture",
        "livebode_design.matrix.matrix_picture.save_matrix_excitation_picture",
    ),
    "margins": ("livebode_control.margins.loop_picture.save_loop_picture",),
    "tune": ("livebode_control.proposal.tuning_picture.save_tuning_picture",),
    "validate": ("livebode_control.validation.validation_picture.save_validation_picture",),
}
"""By command: what draws the picture beside its results."""


@contextlib.contextmanager
def no_pictures(command: object = "run") -> Iterator[None]:
    """A command ends without its pictures, which take up to four fifths of its time and are drawn alike for any."""
    drawn = ("livebode.pictures.save_pictures", "livebode.pictures.save_matrix_pictures")
    with contextlib.ExitStack() as stack:
        for name in (*drawn, *_DRAWN.get(str(command), ())):
            stack.enter_context(mock.patch(name, return_value=None))
        yield


def livebode(*arguments: object, pictures: bool = False) -> Result:
    """`livebode` with these arguments, as its entry point would be called; `pictures`: with those that it draws."""
    out, err, code = io.StringIO(), io.StringIO(), 0
    with (
        contextlib.nullcontext() if pictures else no_pictures(*arguments[:1]),
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
