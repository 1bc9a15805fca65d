"""A run's responses, read again from its directory."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from livebode.nouns import InputError, Lines, Responses


def read_run(directory: Path) -> tuple[Responses, dict[str, Any]]:
    """The responses of a run and what its run.json says.

    Raises
    ------
    InputError
        If the directory is not that of a run, or its files do not belong together.
    """
    try:
        summary = json.loads((directory / "run.json").read_text(encoding="utf-8"))
        table = pq.read_table(directory / "responses.parquet")
        found = summary["found"]
        rate_hz, window = float(found["rate_hz"]), int(found["window"])
        bins = [round(f * window / rate_hz) for f in found["frequency_hz"]]
        columns = {name: table[name].to_numpy() for name in table.column_names}
        return _responses(columns, Lines.of_bins(bins, window, rate_hz), summary), summary
    except FileNotFoundError as error:
        raise InputError(f"{str(directory)!r} is not the directory of a run: {error.filename} is missing") from None
    except OSError as error:
        raise InputError(f"{str(directory)!r} cannot be read: {error.strerror or error}") from None
    except (ValueError, KeyError, TypeError, pa.ArrowException) as error:
        raise InputError(f"{str(directory)!r} is damaged ({error}); make the run again") from None


def _responses(columns: dict[str, Any], lines: Lines, summary: dict[str, Any]) -> Responses:
    wide = {name: column.reshape(-1, len(lines)) for name, column in columns.items()}
    if not np.allclose(wide["frequency_hz"], lines.frequency_hz, rtol=1e-12, atol=0):
        raise ValueError("its lines are not those of its run.json")
    sample = wide["sample"][:, 0]
    return Responses(
        lines=lines,
        value=wide["re"] + 1j * wide["im"],
        sigma=wide["sigma"],
        dof=wide["dof"][:, 0],
        coherence=wide["coherence"],
        valid=wide["valid"],
        first=sample - lines.window + 1,
        sample=sample,
        time_s=wide["time_s"][:, 0],
        schedule=wide["schedule"][:, 0],
        quantity=summary["configuration"].get("tracking", {}).get("quantity", "plant"),
        unit=summary["found"]["unit"],
    )
