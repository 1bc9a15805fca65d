"""Rows that are read in C have the values of the definition, cell by cell, whatever bytes are in them."""

from __future__ import annotations

import re

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from livebode.sources import Dialect
from livebode.sources.cells import CellKind
from livebode.sources.delimited import RowError, RowReader
from livebode.tables import NO_MOMENT

CELLS = st.one_of(
    st.floats().map(repr),
    st.text("0123456789.,-+eE ", max_size=25),
    st.sampled_from(
        ["", " ", "NA", "NaN", "-inf", "+Infinity", '"1.5"', '" 2 "', '"a;b"', '"1""2"', '"', "1.#QNAN", "0x10"]
    ),
    st.sampled_from(
        ["2024-02-29 12:30:15", "2024-02-30T12:30:15Z", "1999-12-31T23:59:59.000250+01:00", "2024-01-01 12"]
    ),
    st.integers(0, 10**40).map(str),
)
DIALECTS = st.builds(
    Dialect,
    st.sampled_from(";\t,"),
    st.booleans(),
    st.sampled_from(".,"),
    headings=st.just(("a", "b", "c")),
    kinds=st.tuples(*[st.sampled_from([CellKind.NUMBER, CellKind.MOMENT])] * 3),
    zone=st.sampled_from([None, "UTC"]),
)


def by_definition(reader: RowReader, text: bytes) -> list[np.ndarray] | None:
    """The rows one by one; None where one is refused."""
    try:
        rows = [reader.row(line) for line in re.split(rb"[\r\n]", text) if line]
    except RowError:
        return None
    return [row for row in rows if row is not None]


def as_read(reader: RowReader, text: bytes) -> list[np.ndarray] | None:
    try:
        chunks = [np.array([bits_of(column) for column in chunk]).T for chunk in reader.read(text)]
    except RowError:
        return None
    return [row for rows in chunks for row in rows]


def bits_of(column: np.ndarray) -> np.ndarray:
    """Of moments with missing ones, which are numbers, as of the others."""
    return column if column.dtype == np.float64 else column.view(np.float64)


def check(dialect: Dialect, text: bytes) -> None:
    reader = RowReader(dialect, [0, 2], "utf-8")
    expected, found = by_definition(reader, text), as_read(reader, text)
    assert (expected is None) == (found is None)
    for column, at in enumerate((0, 2)):
        values = np.array([row[column] for row in expected or []])
        if dialect.kinds[at] is CellKind.MOMENT:
            ns = values.view(np.int64)
            values = np.where(ns == NO_MOMENT, np.nan, ns) if NO_MOMENT in ns else values
        np.testing.assert_array_equal(np.array([row[column] for row in found or []]), values)


@settings(max_examples=200, deadline=None)
@example(
    Dialect(",", False, ",", headings=("a", "b", "c"), kinds=(CellKind.NUMBER,) * 3), [["", "0", "0.0", "inf"]], "\n"
)
@example(Dialect(";", True, ".", headings=("a", "b", "c"), kinds=(CellKind.NUMBER,) * 3), [["0.0", "0.0", "0.0"]], "\n")
@given(DIALECTS, st.lists(st.lists(CELLS, min_size=2, max_size=4), max_size=6), st.sampled_from(["\n", "\r\n", "\r"]))
def test_rows_have_the_values_of_their_definition(dialect, rows, end):
    text = end.join(dialect.delimiter.join(cells) for cells in rows).encode()
    check(dialect, text)


@settings(max_examples=200, deadline=None)
@given(DIALECTS, st.binary(max_size=200))
def test_any_bytes_are_rows_or_refused(dialect, text):
    check(dialect, text)
