"""A state whose checksums are right and whose content is not is refused, whatever it contains."""

from __future__ import annotations

import json
import struct
import zlib
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Stage, StateError, StatefulBase, decode, encode
from tests.support.errors import refused

STAGE = Stage("small", 1)


class Small(StatefulBase):
    """A stage with a state of every kind."""

    _stage = STAGE
    _STATE = ("_array", "count", "_inner")

    def __init__(self, *, inner: bool = True) -> None:
        self._array, self.count = np.zeros(3), 0
        self._inner = Small(inner=False) if inner else None


def state_of(description: object, rest: bytes = b"") -> bytes:
    """With right checksums, `rest` as arrays."""
    text = description if isinstance(description, bytes) else json.dumps(description).encode()
    head = struct.pack("<4sHHII", b"LBST", 1, 1, len(text), zlib.crc32(text + rest))
    return head + struct.pack("<I", zlib.crc32(head)) + text + rest


WHOLE: dict[str, Any] = {"stage": "small", "settings": "", "plain": {}, "arrays": {}, "parts": {}}
PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["array", "count", "inner"]), inner),
    max_leaves=6,
)


@settings(max_examples=100, deadline=None)
@given(key=st.sampled_from(list(WHOLE)), value=PLAIN, rest=st.binary(max_size=24))
def test_any_description_is_refused_and_changes_nothing(key: str, value: object, rest: bytes) -> None:
    stage = Small()
    before = stage.snapshot()
    with pytest.raises(StateError) as caught:
        stage.restore(state_of(WHOLE | {key: value}, rest))
    assert "\n" not in str(caught.value)
    assert stage.snapshot() == before


@pytest.mark.parametrize(
    "description",
    [
        b"[" * 100_000, b"", b"\xff", b"null",
        WHOLE | {"arrays": {"array": ["<f8", [1 << 62]]}},
        WHOLE | {"arrays": {"array": ["|O", [3]]}},
        WHOLE | {"arrays": {"array": ["<f8", [-3]]}},
        WHOLE | {"parts": {"inner": 1 << 62}},
    ],
    ids=lambda value: str(value)[:60],
)  # fmt: skip
def test_what_no_state_contains_is_damage(description: object) -> None:
    with refused(StateError, "damaged", name="small"):
        decode(STAGE, state_of(description, bytes(24)))


def test_a_wrong_value_inside_leaves_what_was_restored_before_it_unchanged() -> None:
    stage, other = Small(), Small()
    other._array, other.count = np.ones(3), 7
    wrong = {
        "array": other._array,
        "count": 7,
        "inner": encode(STAGE, {"array": np.zeros(4), "count": 0, "inner": None}),
    }
    before = stage.snapshot()
    with refused(StateError, "damaged", name="small"):
        stage.restore(encode(STAGE, wrong))
    assert stage.snapshot() == before
    stage.restore(other.snapshot())
    assert stage.snapshot() == other.snapshot()


def test_arrays_of_every_type_and_shape_are_exact() -> None:
    values = {
        "empty": np.zeros((4, 0)), "number": np.array(1.5), "complex": np.array([[1 - 2j, complex("nan")]]),
        "float32": np.arange(3, dtype="f4"), "big-endian": np.arange(3, dtype=">i8"), "flags": np.array([True, False]),
        "turned": np.arange(6.0).reshape(2, 3).T, "last": np.zeros(0),
    }  # fmt: skip
    found = decode(STAGE, encode(STAGE, values | {"nan": float("nan"), "sum": np.float64(0.1), "n": np.int64(3)}))
    for name, value in values.items():
        np.testing.assert_array_equal(found[name], value)
        assert found[name].shape == value.shape
        assert found[name].flags.writeable
    assert (str(found["nan"]), found["sum"], found["n"]) == ("nan", 0.1, 3)


def test_what_cannot_be_stored_exactly_is_a_mistake_of_the_programmer() -> None:
    for value in (np.array(["text"]), np.array([{}], dtype=object), object(), {1, 2}):
        with pytest.raises(TypeError, match="cannot be in a state"):
            encode(STAGE, {"value": value})
