"""A C99 header: the period as a constant table, and the lines for the kernel."""

from __future__ import annotations

from pathlib import Path

from livebode.excitation import Waveform
from livebode_design.files.c_names import identifier
from livebode_design.files.facts import as_lines, facts

_PER_ROW = 4


def write_c_header(path: Path, waveform: Waveform, name: str) -> None:
    """``name[NAME_SAMPLES]`` in N m and ``name_bins[NAME_LINES]``; values in hexadecimal, so exactly the doubles.

    The table's type is double, or what NAME_TYPE is defined to before the header is included (float, for a drive
    without double precision: the compiler rounds once).
    """
    word = identifier(name)
    big = word.upper()
    lines = waveform.lines
    # Facts may contain the end of a comment.
    comment = "\n".join(f" * {line}".replace("*/", "* /") for line in as_lines(facts(waveform)))
    values = [float(value).hex() for value in waveform.samples]
    text = f"""/* One period of an excitation, N m.
{comment}
 */
#ifndef {big}_H
#define {big}_H

#ifndef {big}_TYPE
#define {big}_TYPE double
#endif

#define {big}_SAMPLES {lines.window}
#define {big}_LINES {len(lines)}
#define {big}_RATE_HZ {lines.rate_hz!r}
#define {big}_RAMP_PERIODS {waveform.ramp_periods}
#define {big}_PEAK_N_M {waveform.peak.hex()}

static const {big}_TYPE {word}[{big}_SAMPLES] = {{
{_rows(values)}
}};

static const unsigned {word}_bins[{big}_LINES] = {{
{_rows([f"{k}u" for k in lines.bins])}
}};

#endif
"""
    path.write_text(text, encoding="ascii")


def _rows(values: list[str]) -> str:
    rows = (values[i : i + _PER_ROW] for i in range(0, len(values), _PER_ROW))
    return ",\n".join("    " + ", ".join(row) for row in rows)
