"""A run of a small recording, without pictures."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from livebode.configuration import Axis
from livebode.runtime import Destination, run
from tests.support.command import write_parquet


def small_run(folder: Path, columns: Mapping[str, np.ndarray], **sections: dict[str, object]) -> Path:
    """The directory of a run on these columns, with w, u and y; `sections` are those of the configuration besides."""
    given = {
        "source": {"log": write_parquet(folder / "log.parquet", columns)},
        "signals": {"output": "y", "input": "u", "excitation": "w"},
    }
    return run(Axis.of(given | sections, "test"), Destination(folder / "run", lambda *_: None)).directory
