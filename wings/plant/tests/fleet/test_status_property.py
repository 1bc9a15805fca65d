"""Status messages: what was encoded is decoded; of bytes from strangers nothing but StatusError comes."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode_plant.fleet.status_message import (
    AXES_MAX,
    AXIS_STATUS,
    AxisName,
    PartitionNames,
    PartitionStatus,
    StatusError,
    decode,
    encode_names,
    encode_status,
    usable,
)

TEXTS = st.text("ab ü.%7", min_size=1, max_size=20)
NAMES = st.builds(
    PartitionNames,
    st.integers(0, 65535),
    TEXTS,
    st.lists(
        st.builds(AxisName, st.lists(TEXTS, min_size=1, max_size=4).map("/".join)),
        max_size=5,
    ).map(tuple),
    st.lists(TEXTS, max_size=4).map(tuple),
)


def some_status(count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    axes = np.frombuffer(rng.bytes(count * AXIS_STATUS.itemsize), AXIS_STATUS).copy()
    axes["axis"] = np.arange(count)
    return axes


def test_an_axis_has_52_bytes() -> None:
    assert AXIS_STATUS.itemsize == 52
    assert len(encode_status(3, 1, some_status(1000, 1), 1.0)) == 1000 * 52 + 44


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 65535), st.integers(0, 2**32 - 1), st.integers(0, 50), st.integers(0, 99),
    st.floats(0, 1e10), st.integers(0, 2**64 - 1), st.floats(0, 1e6, width=32),
)  # fmt: skip
def test_a_status_comes_back_bit_by_bit(
    partition: int, table: int, count: int, seed: int, at_s: float, waiting: int, lag_s: float
) -> None:
    axes = some_status(count, seed)
    found = decode(encode_status(partition, table, axes, at_s, waiting, lag_s))
    assert isinstance(found, PartitionStatus)
    assert found.axes.tobytes() == axes.tobytes()
    assert (found.partition, found.table, found.count) == (partition, table, count)
    assert (found.at_s, found.waiting, found.lag_s) == (at_s, waiting, lag_s)


@settings(max_examples=40, deadline=None)
@given(NAMES)
def test_names_come_back(names: PartitionNames) -> None:
    message, table = encode_names(names, 5.0)
    found = decode(message)
    assert isinstance(found, PartitionNames)
    assert found.table == table
    assert (found.partition, found.worker, found.axes, found.kinds) == (
        names.partition, names.worker, names.axes, names.kinds,
    )  # fmt: skip


@settings(max_examples=120, deadline=None)
@given(st.booleans(), st.integers(0, 10**6), st.integers(1, 255), st.integers(0, 40))
def test_a_changed_or_shortened_message_is_rejected(status: bool, at: int, change: int, cut: int) -> None:
    names = PartitionNames(1, "w", (AxisName("a/b"),), ("change",))
    message = encode_status(1, 2, some_status(3, 1), 1.0) if status else encode_names(names, 1.0)[0]
    changed = bytearray(message)
    changed[at % len(message)] ^= change
    for wrong in (bytes(changed), message[: len(message) - 1 - cut], message + b"\0"):
        with pytest.raises(StatusError):
            decode(wrong)


def signed(message: bytes) -> bytes:
    """With the right sum, as an attacker would send it."""
    return message[:-4] + struct.pack("<I", zlib.crc32(message[:-4]))


def packed(kind: int, count: int, body: bytes, at_s: float = 1.0, table: int | None = None) -> bytes:
    table = zlib.crc32(body) if table is None else table
    head = struct.pack("<4sBBHIIdQfI", b"LBST", 1, kind, 0, table, count, at_s, 0, 0.0, len(body))
    return signed(head + body + b"0000")


@pytest.mark.parametrize(
    "message",
    [
        b"",
        b"{}" * 40,
        packed(0, 2, bytes(52)),
        packed(0, 1, bytes(52), at_s=float("nan")),
        packed(0, 1, bytes(52), at_s=-1.0),
        packed(0, AXES_MAX + 1, bytes(52) * (AXES_MAX + 1)),
        packed(7, 0, b""),
        packed(1, 0, b"no zlib"),
        packed(1, 0, zlib.compress(b'{"worker": "w", "axes": [], "kinds": []}'), table=1),
        packed(1, 1, zlib.compress(b'{"worker": "w", "axes": [], "kinds": []}')),
        packed(1, 0, zlib.compress(b'{"worker": 7, "axes": [], "kinds": []}')),
        packed(1, 0, zlib.compress(b'{"axes": [], "kinds": []}')),
        packed(1, 0, zlib.compress(b"[" * 100_000)),
        packed(1, 0, zlib.compress(b" " * (9 << 20) + b"{}")),  # 9 MiB from some kB
        *(
            packed(1, 1, zlib.compress(b'{"worker": "w", "axes": [["%b", "", "", "%b"]], "kinds": []}' % one))
            for one in (
                (b"", b""), (b"a//b", b""), (b"a/b/c/d/e", b""), (b"a\\n", b""),
                (b"a", b"javascript:alert(1)"), (b"a", b"data:text/html,x"), (b"a", b"//host"),
            )
        ),
    ],
)  # fmt: skip
def test_what_a_stranger_signs_is_rejected_too(message: bytes) -> None:
    with pytest.raises(StatusError):
        decode(message)


def test_values_out_of_range_are_found_row_by_row() -> None:
    axes = np.zeros(9, AXIS_STATUS)
    for row, (name, value) in enumerate(
        [("state", 4), ("priority", 4), ("flags", 32), ("lag_s", np.nan), ("lag_s", -1), ("effective_s", np.inf),
         ("value", -np.inf), ("change_percent", np.inf)]
    ):  # fmt: skip
        axes[name][row] = value
    assert usable(axes).tolist() == [False] * 8 + [True]
