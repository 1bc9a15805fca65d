"""Numbers in text: read, they are the nearest doubles; written, the shortest decimals, with the bytes of PyArrow."""

from __future__ import annotations

import io
from decimal import Decimal

import numpy as np
import pyarrow as pa
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pyarrow import csv

from livebode.tables import NUMBER, TableLayout, Words, read_rows, write_rows

LAYOUT = TableLayout(bytes([NUMBER]), b"", 1 << 20, ord(","), ord("."), 0, False)
DECIMALS = st.builds(
    "{}{}e{}".format, st.sampled_from(["", "-", "+"]), st.integers(0, 10**19 - 1), st.integers(-400, 330)
)
BETWEEN = st.floats(0, 1e300).map(lambda x: f"{(Decimal(x) + Decimal(np.nextafter(x, np.inf))) / 2:.18e}")
"""Nearly half way between two doubles."""


def read(text: str) -> np.ndarray:
    out = np.empty((1, 1 + len(text)))
    filled, used = read_rows(LAYOUT, text.encode(), 0, out, 0)
    assert used == len(text)
    return out[0, :filled]


@settings(max_examples=150, deadline=None)
@given(st.lists(st.one_of(DECIMALS, BETWEEN, st.floats(allow_nan=False).map(repr)), min_size=1, max_size=20))
@example(["9007199254740993", "4503599627370497.5", "2.4703282292062327e-324", "2.4703282292062328e-324", "1.8e308"])
def test_a_number_is_the_nearest_double(words):
    np.testing.assert_array_equal(
        read("\n".join(words)).view(np.int64), np.array([float(word) for word in words]).view(np.int64)
    )


def test_more_digits_than_fit_are_left_to_the_definition_only_between_two_doubles():
    assert read("123456789012345678901234567890") == 123456789012345678901234567890
    assert read("0.10000000000000000000000000000000001") == 0.1
    out = np.empty((1, 1))
    assert read_rows(LAYOUT, b"4503599627370496.50000000000000000001", 0, out, 0) == (0, 0)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.floats(), min_size=1, max_size=20))
@example([0.1, 1e-6, 1e-7, 1e9, 1e10, 123456789.5, 2.0**53, 5e-324, 1.7976931348623157e308, -0.0, 2.0**-1022])
def test_a_number_is_written_as_by_pyarrow_with_the_digits_of_repr(values):
    numbers = np.array(values)
    found = bytes(write_rows([numbers])).decode().splitlines()
    sink = io.BytesIO()
    csv.write_csv(pa.table({"x": numbers}), sink, csv.WriteOptions(include_header=False))
    assert found == sink.getvalue().decode().splitlines()
    finite = [(word, value) for word, value in zip(found, values, strict=True) if np.isfinite(value)]
    assert all(Decimal(word).normalize() == Decimal(repr(value)).normalize() for word, value in finite)


@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(-(2**63), 2**63 - 1), st.integers(0, 2)), min_size=1, max_size=20))
def test_integers_and_words_are_written_as_they_are(rows):
    integers, at = (np.array(column) for column in zip(*rows, strict=True))
    words = [b'"a"', b"", b'"long ""word"""']
    expected = "".join(f"{integer},{words[word].decode()}\n" for integer, word in rows)
    assert bytes(write_rows([integers, Words(words, at)])).decode() == expected
