"""Tables in text: whatever their delimiter, decimal mark, encoding and preamble, the values come back exactly."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from livebode.sources import Log, open_log

QUICK = settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
NUMBERS = st.floats(allow_nan=False, allow_infinity=False, width=64)
DIALECTS = [
    (delimiter, decimal) for delimiter in (",", ";", "\t", "|", "   ") for decimal in ".," if delimiter != decimal
]


def opened(folder: Path, text: str, encoding: str = "utf-8", **options: object) -> Log:
    path = folder / "log.csv"
    path.write_bytes(text.encode(encoding))
    return open_log(path, **options)


def samples(log: Log, *names: str) -> np.ndarray:
    return np.concatenate([block.data for block in log.blocks(names or None)], axis=1)


@QUICK
@given(
    st.lists(st.lists(NUMBERS, min_size=3, max_size=3), min_size=2, max_size=30),
    st.sampled_from(DIALECTS),
    st.sampled_from(["utf-8", "utf-8-sig", "latin-1", "utf-16"]),
    st.sampled_from(["\n", "\r\n"]),
    st.booleans(),
    st.booleans(),
)
def test_any_dialect_gives_the_values_back(tmp_path, rows, dialect, encoding, end, header, preamble):
    delimiter, decimal = dialect
    lines = [delimiter.join(repr(value).replace(".", decimal) for value in row) for row in rows]
    if header:
        lines.insert(0, delimiter.join(["iq_µ", "speed", "note_3"]))
    if header and preamble:
        lines[:0] = ["# recorded by hand", "Operator: Müller", ""]
    log = opened(tmp_path, end.join(lines) + end, encoding, rate_hz=1000)
    assert [channel.name for channel in log.channels] == (["iq_µ", "speed", "note_3"] if header else ["c1", "c2", "c3"])
    np.testing.assert_array_equal(samples(log).T, np.array(rows))


def test_units_in_either_brackets(tmp_path):
    log = opened(tmp_path, "t [ms];speed (rad/s);iq[A];u\n0;1,5;2;3\n0,25;2,5;3;4\n")
    assert [(c.name, c.unit) for c in log.channels] == [("t", "ms"), ("speed", "rad/s"), ("iq", "A"), ("u", "")]
    assert log.rate_hz == 4000
    assert samples(log, "speed (rad/s)").tolist() == [[1.5, 2.5]]


def test_units_in_a_row_below_the_header(tmp_path):
    log = opened(tmp_path, "time,speed\nms,rad/s\n0,1\n1,2\n2,3\n")
    assert [(c.name, c.unit) for c in log.channels] == [("time", "ms"), ("speed", "rad/s")]
    assert (log.rate_hz, log.samples) == (1000, 3)


def test_a_preamble_with_the_columns_of_the_table_is_skipped(tmp_path):
    log = opened(tmp_path, "Operator;Miller\nMachine;5\n\nt;u\n0,000;1\n0,001;2\n")
    assert samples(log, "t", "u").tolist() == [[0, 0.001], [1, 2]]


def test_the_separator_line_of_excel_is_read(tmp_path):
    log = opened(tmp_path, "sep=;\nt;u\n0;1\n0,5;2\n")
    assert (log.rate_hz, samples(log, "u").tolist()) == (2, [[1, 2]])


def test_a_trailing_delimiter_adds_no_channel(tmp_path):
    for header in ("t;u;", "t;u"):
        log = opened(tmp_path, f"{header}\n0;1;\n0,5;2;\n")
        assert [c.name for c in log.channels] == ["t", "u"]


def test_empty_cells_are_nan_and_text_columns_are_named(tmp_path):
    log = opened(tmp_path, "t,u,state\n0,1,ok\n0.1,,ok\n0.2,NaN,\n0.3,-inf,bad\n")
    assert [(skipped.name, skipped.reason) for skipped in log.skipped] == [("state", "it contains text")]
    np.testing.assert_array_equal(samples(log, "u"), [[1, np.nan, np.nan, -np.inf]])


def test_comments_between_the_rows(tmp_path):
    log = opened(tmp_path, "t,u\n0,1\n# the spindle stood still, 3 s\n0.1,2\n% so did we\n0.2,3\n")
    assert samples(log, "u").tolist() == [[1, 2, 3]]


def test_iso_moments_are_time(tmp_path):
    for pattern in ("2024-01-01 12:00:0{}.{:06d}", "2024-01-01T12:00:0{}.{:06d}Z"):
        rows = [f"{pattern.format(k // 4000, k % 4000 * 250)},{k}" for k in range(8000)]
        log = opened(tmp_path, "when,u\n" + "\n".join(rows))
        assert log.rate_hz == 4000
        assert [c.name for c in log.channels] == ["u"]
        assert next(log.blocks()).origin_s == 1704110400.0


@pytest.mark.parametrize("end", ["", "\n", "\n\n"])
def test_the_last_line_may_lack_its_end(tmp_path, end):
    assert samples(opened(tmp_path, f"u,v\n1,2\n3,4{end}", rate_hz=1)).tolist() == [[1, 3], [2, 4]]
