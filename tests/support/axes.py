"""What the tests of the simulated axis share."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from livebode.core import Lines
from livebode.excitation import multisine
from livebode.simulation import Strokes

RATE_HZ = 4000.0
LINES = Lines.parse("20:140:20", rate_hz=RATE_HZ, window=400)
MULTISINE = multisine(LINES)
MULTISINE.flags.writeable = False


def fast_stroke(**options: float) -> Strokes:
    """From 0.3 to 1.55 m in 0.71 s: the whole of the belt in few ticks."""
    return Strokes(**({"start_m": 0.3, "end_m": 1.55, "speed_m_per_s": 2.5, "acceleration_m_per_s2": 12.0} | options))


def compiled(source: Path, folder: Path) -> str:
    """Assembly of a C source, with every warning an error; skipped without a compiler."""
    gcc = shutil.which("gcc")
    if gcc is None:
        pytest.skip("gcc is not installed")
    out = folder / "out.s"
    warnings = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror", "-ffp-contract=off"]
    subprocess.run([gcc, *warnings, "-O3", "-march=native", "-S", str(source), "-o", str(out)], check=True)
    return out.read_text()
