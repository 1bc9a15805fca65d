"""`python -m tests.support.stored_matrix FOLDER`: writes the stored matrix run of version 2 of the run directory."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import numpy as np

from livebode.core import Block, Event, Lines, MatrixResponses
from livebode.excitation import MatrixExcitation
from livebode.records import MATRIX_TABLES, RunDirectory
from livebode_matrix import MatrixSettings, MatrixTracker
from tests.support.stored import digest

LINES = Lines.parse("40,100", 400.0, 20)
NAMES = ("u1", "u2", "y1", "y2")
ARRAYS = ("value", "noise", "spread", "dof", "coherence", "condition", "reason", "first", "sample", "time_s")
_KIND = {"output": "velocity", "input": "torque", "output_unit": "rad/s", "input_unit": "N m"}


def matrices() -> MatrixResponses:
    """Of a plant without dynamics, with a sample that is not finite."""
    u = np.round(np.tile(MatrixExcitation.orthogonal(LINES, 2).samples, 6) * 64) / 64
    y = np.array([[2.0, 1.0], [0.5, 3.0]]) @ u + np.round(np.sin(np.arange(u.shape[1]) ** 2)) / 64
    y[0, 130] = np.nan
    settings = MatrixSettings(
        lines=LINES, output=NAMES[2:], input=NAMES[:2], estimator="direct", hop=10, memory=2, average=True
    )
    return MatrixTracker(settings).process(Block(np.vstack([u, y]), NAMES, LINES.rate_hz))


def content(responses: MatrixResponses) -> dict[str, str]:
    """SHA-256 of each array, little-endian; of NaN without its sign."""
    return {name: digest(np.nan_to_num(getattr(responses, name), nan=-1.0)) for name in ARRAYS}


def write(folder: Path) -> None:
    found = {
        "rate_hz": LINES.rate_hz, "window": LINES.window, "bins": list(LINES.bins), "quiet_bins": [], "hop": 10,
        "quantity": "plant", "unit": "", "outputs": NAMES[2:], "inputs": NAMES[:2], "units": [["rad/s/(N m)"] * 2] * 2,
        "kinds_of_entries": [[_KIND] * 2] * 2,
    }  # fmt: skip
    responses = matrices()
    with RunDirectory(folder / "piece", MATRIX_TABLES) as directory:
        directory.write(responses)
        directory.write_event(Event("non-finite", 130, 0.325, "a sample is not finite"))
        directory.finish({"matrix": True, "found": found, "configuration": {}}, lambda _: None)
    (folder / "expected.json").write_text(json.dumps(content(responses), indent=1) + "\n")


if __name__ == "__main__":
    shutil.rmtree(sys.argv[1], ignore_errors=True)
    Path(sys.argv[1]).mkdir(parents=True)
    write(Path(sys.argv[1]))
