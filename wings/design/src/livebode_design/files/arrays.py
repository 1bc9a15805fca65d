"""NPZ and MATLAB: the samples, the lines, and the facts as JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from livebode.core import needing
from livebode.excitation import Waveform
from livebode_design.files.c_names import identifier
from livebode_design.files.facts import facts

_TEXT_BYTES = 116  # header text of a v5 file, free except for its first four bytes


def _arrays(waveform: Waveform) -> dict[str, Any]:
    lines = waveform.lines
    at = list(lines.bins)
    return {
        "samples": waveform.samples,
        "frequency_hz": lines.frequency_hz,
        "amplitude": waveform.amplitude,
        "phase": np.angle(waveform.spectrum[at]) + np.pi / 2,  # of sines, as in eq. (6)
        "rate_hz": lines.rate_hz,
        "facts": json.dumps(facts(waveform)),
    }


def write_npz(path: Path, waveform: Waveform, name: str) -> None:
    """Arrays `samples` (window,), `frequency_hz`, `amplitude` and `phase` (lines,), `rate_hz`, `name`, `facts`."""
    with path.open("wb") as file:  # NumPy adds a suffix to a path
        np.savez(file, name=name, **_arrays(waveform))


def write_mat(path: Path, waveform: Waveform, name: str) -> None:
    """A MATLAB v5 file with one struct of that name; its arrays are columns, `Ts` is the sample time in seconds."""
    with needing("SciPy", "analysis", "a design for MATLAB"):
        from scipy.io import savemat

    found = _arrays(waveform)
    columns = {key: value[:, np.newaxis] if np.ndim(value) else value for key, value in found.items()}
    struct = columns | {"Ts": 1 / waveform.lines.rate_hz}
    savemat(path, {identifier(name, "MATLAB"): struct}, appendmat=False)
    with path.open("r+b") as file:  # instead of the time of day, so that the same design gives the same file
        file.write(b"MATLAB 5.0 MAT-file, written by livebode".ljust(_TEXT_BYTES))
