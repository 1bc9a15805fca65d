"""The excitation of examples/drive, built for this computer: enabled at borders, ramped both ways, within its limit."""

from __future__ import annotations

import ctypes
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from livebode import Lines, multisine
from livebode.excitation import Waveform
from livebode_design import write
from tools.firmware import KERNEL, ROOT, run

FOLDER = ROOT / "examples" / "drive"
N, RAMP = 20, 3 * 20
pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")
OPTIONS = ("-DDRIVE_HOP=10",)


def made(window: int, rate_hz: float, amplitude: float) -> Waveform:
    lines = Lines((1, 3), window, rate_hz)
    return Waveform(lines, multisine(lines, amplitude), {"ramp_s": 3 * window / rate_hz})


EXCITATION = made(N, 4000, 0.1)
PERIOD = EXCITATION.samples


def compiled(folder: Path, waveform: Waveform, *options: str) -> None:
    write(folder / "excitation.h", waveform)
    includes = [f"-I{path}" for path in (folder, FOLDER, FOLDER.parent, KERNEL / "include")]
    flags = ("-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-DLB_SCALAR", "-DLB_BITS=32")
    sources = [FOLDER / "drive.c", *sorted((KERNEL / "src").glob("*.c"))]
    run("gcc", *flags, *options, *includes, "-shared", "-fPIC", *sources, "-o", folder / "drive.so")


class Drive:
    """The functions of drive.c, freshly begun."""

    def __init__(self, folder: Path) -> None:
        self.library = ctypes.CDLL(str(folder / "drive.so"))
        self.library.drive_excitation.restype = ctypes.c_float
        self.library.drive_tick.argtypes = [ctypes.c_float, ctypes.c_float]
        self.library.drive_begin.argtypes = [ctypes.c_uint64]
        assert self.library.drive_begin(1) == 0

    def played(self, cycles: int, on: bool) -> np.ndarray:
        self.library.drive_enable(on)
        found = []
        for _ in range(cycles):
            found.append(self.library.drive_excitation())
            assert self.library.drive_excitation() == found[-1]
            self.library.drive_tick(found[-1], 30.0)
        return np.array(found)


def level(switched: list[tuple[int, bool]]) -> np.ndarray:
    """Of the ramp at each sample, in samples, where enable is so for so many cycles in turn; from the description."""
    enabled = np.repeat([on for _, on in switched], [cycles for cycles, _ in switched])
    levels, rising, now = [], False, 0
    for n in range(len(enabled)):
        rising = bool(enabled[n - 1]) if n % N == 0 and n else rising
        levels.append(now)
        now = min(now + 1, RAMP) if rising else max(now - 1, 0)
    return np.array(levels)


def test_the_excitation_is_ramped_up_and_down_over_whole_periods_whenever_it_is_switched(tmp_path: Path) -> None:
    compiled(tmp_path, EXCITATION, *OPTIONS)
    drive, rng = Drive(tmp_path), np.random.default_rng(7)
    switched = [(N - 1, False), (N + RAMP + 5 * N, True), (7, False), (2 * RAMP, False)]
    switched += [(int(rng.integers(1, 4 * N)), bool(rng.random() < 0.6)) for _ in range(200)]
    w = np.concatenate([drive.played(*part) for part in switched])
    levels, table = level(switched), PERIOD.astype(np.float32)
    np.testing.assert_array_equal(w, np.resize(table, len(w)) * (levels.astype(np.float32) / np.float32(RAMP)))
    first = int(np.flatnonzero(levels)[0]) - 1
    assert first == N
    np.testing.assert_array_equal(w[first + RAMP : first + RAMP + 4 * N].reshape(-1, N), np.tile(table, (4, 1)))
    assert np.abs(np.diff(levels)).max() == 1
    turns = np.flatnonzero(np.diff(np.sign(np.diff(levels))) * (levels[1:-1] > 0) * (levels[1:-1] < RAMP)) + 1
    assert not np.any(turns % N)
    assert np.abs(w).max() <= np.float32(np.abs(PERIOD).max())
    assert {0, RAMP} <= set(levels)


@pytest.mark.parametrize(
    ("excitation", "message"),
    [
        ((401, 4000, 0.1), "DRIVE_HOP must divide"),
        ((400, 8000, 0.1), "another rate than DRIVE_RATE_HZ"),
        ((400, 4000, 0.5), "exceeds DRIVE_LIMIT_N_M"),
    ],
)
def test_a_header_that_the_drive_cannot_play_does_not_compile(excitation, message: str, tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match=message):
        compiled(tmp_path, made(*excitation), "-fsyntax-only")


def test_the_drive_compiles_with_the_values_that_its_refusals_name(tmp_path: Path) -> None:
    compiled(tmp_path, made(401, 4000, 0.5), "-DDRIVE_HOP=401", "-DDRIVE_LIMIT_N_M=1.0f", "-fsyntax-only")


def test_the_makefile_takes_the_header_that_is_asked_for_last(tmp_path: Path) -> None:
    mine = tmp_path / "design" / "excitation.h"
    mine.parent.mkdir()
    write(mine, EXCITATION)

    def copied(*options: str) -> bytes:
        built = tmp_path / "build" / "excitation.h"
        run("make", "-C", FOLDER, built, f"BUILD={built.parent}", f"PYTHON={sys.executable}", *options)
        return built.read_bytes()

    own = copied()
    assert copied(f"EXCITATION={mine}") == mine.read_bytes() != own
    assert copied() == own
