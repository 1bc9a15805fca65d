"""CSV: one row for each sample, below comments that describe it."""

from __future__ import annotations

from pathlib import Path

from livebode.core import DesignError
from livebode.excitation import Waveform
from livebode_design.files.facts import as_lines, facts


def write_csv(path: Path, waveform: Waveform, name: str) -> None:
    """Columns ``time [s]`` and the name with its unit; every number is the shortest decimal with the same double.

    ``open_log`` reads it back as a recording.
    """
    if not name.isprintable() or not name.strip() or set(name) & set(',;"\t[]#%'):
        raise DesignError(
            "name-forbidden",
            f"{name=} cannot head a column of a CSV file",
            "choose letters, digits and underscores",
            argument="name",
            name=name,
        )
    head = [f"# {line}" for line in as_lines(facts(waveform))]
    rate_hz = waveform.lines.rate_hz
    rows = (f"{n / rate_hz!r},{value!r}" for n, value in enumerate(waveform.samples.tolist()))
    path.write_text("\n".join([*head, f"time [s],{name} [N m]", *rows]) + "\n", encoding="utf-8")
