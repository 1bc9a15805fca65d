"""Functions that exist for several instruction sets: each has the bits of the definition in NumPy."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy._core._multiarray_umath import __cpu_features__
from numpy.typing import NDArray

from livebode.motion import late
from livebode.simulation import Pair, open_belt

Floats = NDArray[np.float64]

SOURCE = Path(__file__).parents[2] / "simulation"
SETS = {
    "baseline": ([], []),
    "avx2": (["-mavx2", "-mno-fma"], ["AVX2"]),
    "avx512": (["-mavx512f", "-mavx512vl"], ["AVX512F", "AVX512VL"]),
}
RATE_HZ, RADIUS_M, TICKS = 4000.0, 0.019, 300
RNG = np.random.default_rng(3)
PAIRS = [Pair(0.0028 * (1 + 0.02 * i), 6.7 - 0.1 * i, 1 + 0.01 * i, 1 - 0.02 * i) for i in range(13)]
TORQUE = RNG.normal(size=(len(PAIRS), TICKS))
STIFFNESS, DAMPING = RNG.uniform(4e5, 6e5, TICKS), RNG.uniform(100, 150, TICKS)


class Course(ctypes.Structure):
    """lb_two_masses_course."""

    _fields_ = (
        ("ticks", ctypes.c_size_t), ("rate_hz", ctypes.c_double), ("radius_m", ctypes.c_double),
        ("stiffness", ctypes.c_void_p), ("damping", ctypes.c_void_p),
    )  # fmt: skip


def definition(pairs: list[Pair], torque: Floats) -> tuple[Floats, Floats]:
    """Taylor series of order 8 of each tick, in the order of the operations."""
    inertia, load, stiffness, damping = np.array(pairs).T
    state = np.zeros((3, len(pairs)))
    motor, cart = np.empty((2, len(pairs), TICKS))
    for n in range(TICKS):
        motor[:, n], cart[:, n] = state[1:]
        k, b, term = STIFFNESS[n] * stiffness, DAMPING[n] * damping, state
        for order in range(1, 9):
            rate = RADIUS_M * term[1] - term[2]
            force = k * term[0] + b * rate
            drive = torque[:, n] if order == 1 else 0.0
            slope = np.stack([rate, (drive - RADIUS_M * force) * (1 / inertia), force * (1 / load)])
            term = 1 / RATE_HZ / order * slope
            state = state + term
    return motor, cart


@pytest.fixture(scope="module", params=list(SETS))
def compiled(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    flags, needed = SETS[request.param]
    gcc = shutil.which("gcc")
    if gcc is None or not all(__cpu_features__.get(one, False) for one in needed):
        pytest.skip(f"neither gcc nor a processor with {request.param}")
    out = tmp_path_factory.mktemp("sets") / "set.so"
    options = ["-std=c99", "-O3", "-shared", "-fPIC", "-ffp-contract=off", *flags]
    sources = [str(SOURCE / "two_masses.c"), str(SOURCE / "late.c")]
    subprocess.run([gcc, *options, *sources, "-o", str(out), "-lm"], check=True)
    return ctypes.CDLL(str(out))


@pytest.mark.parametrize("count", [1, 5, 8, 13])
def test_pairs_of_masses_have_the_bits_of_the_definition(compiled: ctypes.CDLL, count: int) -> None:
    pairs, torque = np.array(PAIRS[:count]), np.ascontiguousarray(TORQUE[:count])
    motor, cart = np.empty((2, count, TICKS))
    course = Course(TICKS, RATE_HZ, RADIUS_M, STIFFNESS.ctypes.data, DAMPING.ctypes.data)
    compiled.lb_two_masses_advance(
        ctypes.byref(course), ctypes.c_size_t(count), ctypes.c_void_p(pairs.ctypes.data),
        ctypes.c_void_p(torque.ctypes.data), ctypes.c_size_t(TICKS), ctypes.c_void_p(motor.ctypes.data),
        ctypes.c_void_p(cart.ctypes.data),
    )  # fmt: skip
    expected = definition(PAIRS[:count], torque)
    assert np.array_equal([motor, cart], expected)
    installed = open_belt(PAIRS[:count], torque, STIFFNESS, DAMPING, rate_hz=RATE_HZ, radius_m=RADIUS_M)
    assert np.array_equal(installed, expected)


def test_late_rows_have_the_same_bits(compiled: ctypes.CDLL) -> None:
    """Those of SciPy, with which tests/motion compares the installed version."""
    rows, shifted = TORQUE.cumsum(axis=1), np.empty_like(TORQUE)
    work = np.empty((TICKS + 24) * 8)
    for samples in (0.4, -1.2e-3, 7.7):
        compiled.lb_late(
            ctypes.c_size_t(len(rows)), ctypes.c_size_t(TICKS), ctypes.c_double(samples),
            ctypes.c_void_p(rows.ctypes.data), ctypes.c_void_p(shifted.ctypes.data),
            ctypes.c_void_p(work.ctypes.data),
        )  # fmt: skip
        assert np.array_equal(shifted, late(rows, samples))
