"""Vectors of a MATLAB v5 file, streamed, and the same read at once by SciPy."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import RecordingError
from livebode.sources import open_log
from livebode.sources.matlab import LENGTH_MIN

CODES = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "f4": 7, "f8": 9}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("mat")


@settings(max_examples=40, deadline=None)
@given(
    length=st.integers(LENGTH_MIN - 2, 4 * LENGTH_MIN),
    kind=st.sampled_from(["f8", "f4", "i2", "u1", "i4", "i8"]),
    row=st.booleans(),
    packed=st.booleans(),
    block=st.integers(1, 3 * LENGTH_MIN),
    seed=st.integers(0, 9),
)
def test_a_vector_is_that_of_scipy(
    folder: Path, length: int, kind: str, row: bool, packed: bool, block: int, seed: int
) -> None:
    path, rng = folder / "a.mat", np.random.default_rng(seed)
    y = rng.integers(0, 100, length).astype(kind) if kind[0] != "f" else rng.standard_normal(length).astype(kind)
    given_ = {"t": np.arange(length) / 1000.0, "y": y, "k": rng.standard_normal((3, length)), "fs": 1000.0}
    scipy.io.savemat(path, given_, do_compression=packed, oned_as="row" if row else "column")
    log = open_log(path, block_samples=block)
    names = ["y", "k(1)", "k(2)", "k(3)"]
    found = np.concatenate([part.data for part in log.blocks(names)], axis=1)
    truth = scipy.io.loadmat(path)
    np.testing.assert_array_equal(found, np.vstack([truth["y"].ravel(), truth["k"]]))


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("kind", CODES)
def test_numbers_in_a_smaller_type_than_their_class_are_those_of_scipy(tmp_path: Path, order: str, kind: str) -> None:
    values = (np.arange(LENGTH_MIN + 3) % 100).astype(order + kind)
    path = _written(tmp_path / "a.mat", order, kind, values)
    (block,) = open_log(path, rate_hz=1000).blocks(["y"])
    np.testing.assert_array_equal(block["y"], scipy.io.loadmat(path)["y"].ravel())


def test_fewer_values_than_declared_are_damage_that_names_the_variable(tmp_path: Path) -> None:
    path = _written(tmp_path / "a.mat", "<", "f8", np.zeros(2 * LENGTH_MIN), declared=2 * LENGTH_MIN + 1)
    with pytest.raises(RecordingError, match="variable y declares 2049 values, and has 16384 bytes of type 9"):
        list(open_log(path, rate_hz=1000).blocks(["y"]))


def _written(path: Path, order: str, kind: str, values: np.ndarray, declared: int | None = None) -> Path:
    """A file with the double vector y, stored as MATLAB stores numbers that are whole: in a smaller type."""

    def element(code: int, data: bytes) -> bytes:
        return struct.pack(order + "II", code, len(data)) + data + bytes(-len(data) % 8)

    dims = struct.pack(order + "ii", declared or len(values), 1)
    inner = [element(6, struct.pack(order + "II", 6, 0)), element(5, dims), element(1, b"y")]
    matrix = element(14, b"".join([*inner, element(CODES[kind], values.tobytes())]))
    mark = struct.pack(order + "HH", 0x0100, 0x4D49)
    path.write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + mark + matrix)
    return path
