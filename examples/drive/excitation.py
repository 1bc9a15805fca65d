"""Writes one period of a multisine as a C header for drive.c.

python examples/drive/excitation.py 20:220:10 > excitation.h
"""

from __future__ import annotations

import sys

import numpy as np

from livebode import Lines, multisine

RATE_HZ, WINDOW, AMPLITUDE_N_M = 4000, 400, 0.05


def header(lines: Lines, amplitude: float) -> str:
    """The text of the header; the period has the rounding of float."""
    period = multisine(lines, amplitude).astype(np.float32)
    rows = [", ".join(f"{x:.9e}f" for x in row) for row in period.reshape(-1, 4)]
    bins = [str(k) for k in lines.bins]
    return "\n".join(
        [
            f"/* A multisine of {len(bins)} lines, Schroeder phases, amplitude {amplitude:g} each. */",
            f"#define EXCITATION_RATE_HZ {lines.rate_hz:g}.0",
            f"#define EXCITATION_PERIOD {lines.window}",
            f"#define EXCITATION_LINES {len(bins)}",
            f"#define EXCITATION_BINS {', '.join(bins)}",
            f'#define EXCITATION_BINS_TEXT "{" ".join(bins)}"',
            "static const float excitation[EXCITATION_PERIOD] = {",
            *(f"    {row}," for row in rows),
            "};\n",
        ]
    )


if __name__ == "__main__":
    print(header(Lines.parse(sys.argv[1], rate_hz=RATE_HZ, window=WINDOW), AMPLITUDE_N_M), end="")
