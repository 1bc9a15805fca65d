"""Writes the excitation of the example as a C header; `livebode design` leaves one of the same shape for a machine.

python excitation.py 20:220:10 excitation.h
"""

from __future__ import annotations

import sys
from pathlib import Path

from livebode import Lines, multisine
from livebode.excitation import Waveform
from livebode_design import write

RATE_HZ, WINDOW, AMPLITUDE_N_M, RAMP_S = 4000, 400, 0.05, 0.5

if __name__ == "__main__":
    lines = Lines.parse(sys.argv[1], rate_hz=RATE_HZ, window=WINDOW)
    about = {"kind": "multisine", "phases": "schroeder", "amplitude_n_m": AMPLITUDE_N_M, "ramp_s": RAMP_S}
    write(Path(sys.argv[2]), Waveform(lines, multisine(lines, AMPLITUDE_N_M), about))
