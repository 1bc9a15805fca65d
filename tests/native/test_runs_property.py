"""Integers in runs of Parquet: those of the definition from any bytes, or the same refusal."""

from __future__ import annotations

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from livebode.kernel import decode_runs
from tests.twins.runs import decode_runs as definition


def outcome(decode, *arguments):
    try:
        return list(decode(*arguments))
    except ValueError as error:
        return str(error)


@st.composite
def runs(draw: st.DrawFn) -> tuple[bytes, int, int]:
    """Whole runs, and how many integers they have."""
    width, data, count = draw(st.integers(0, 32)), b"", 0
    for length in draw(st.lists(st.integers(0, 70), min_size=1, max_size=8)):
        is_packed = draw(st.booleans())
        size = length * width if is_packed else -(-width // 8)
        head = length << 1 | is_packed
        data += bytes([head & 0x7F | 0x80, head >> 7]) + draw(st.binary(min_size=size, max_size=size))
        count += 8 * length if is_packed else length
    return data, width, count


@settings(max_examples=100, deadline=None)
@given(runs(), st.integers(0, 9))
def test_runs_are_those_of_the_definition(found, fewer):
    data, width, count = found
    assert outcome(decode_runs, data, width, max(0, count - fewer)) == definition(data, width, max(0, count - fewer))
    with pytest.raises(ValueError, match="a page is cut"):
        decode_runs(data, width, count + 1)


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=40), st.integers(0, 32), st.integers(0, 300))
@example(b"\xff\xff\xff\xff\x7f", 32, 9)
@example(b"\xfe\xff\xff\xff\x7f", 0, 9)
@example(b"\x80\x80\x80\x80\x80\x01", 1, 1)
@example(b"\x00\x01" * 9 + b"\x03\xff", 1, 8)
def test_any_bytes_are_decoded_or_refused_as_by_the_definition(data, width, count):
    assert outcome(decode_runs, data, width, count) == outcome(definition, data, width, count)


def test_a_width_that_cannot_be_is_refused():
    with pytest.raises(ValueError, match="33 bits"):
        decode_runs(b"\x02\x01", 33, 1)
