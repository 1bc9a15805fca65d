"""Text tables as other programs write them: header in a comment, columns of text, rows and ends of LabVIEW."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from livebode.core import RecordingError
from livebode.preparation import inspect
from livebode.sources import Log, open_log
from tests.support.errors import refused

QUICK = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
WORDS = st.sampled_from(["ANGLE_MODE|HORIZON", "ARM", "IDLE", "SMALL_ANGLE", "a b"])


def opened(folder: Path, text: str, **options: object) -> Log:
    path = folder / "log.csv"
    path.write_bytes(text.encode())
    return open_log(path, **options)


def names(log: Log) -> list[tuple[str, str]]:
    return [(channel.name, channel.unit) for channel in log.channels]


def samples(log: Log, name: str) -> list[float]:
    return np.concatenate([block[name] for block in log.blocks([name])]).tolist()


def sniffed(path: Path) -> tuple[str, list[str], list[str]]:
    """Delimiter, names and types of the columns as DuckDB detects them."""
    import duckdb

    row = duckdb.sql(f"select Delimiter, Columns from sniff_csv('{path}')").fetchall()[0]
    return row[0], [column["name"].strip() for column in row[1]], [column["type"] for column in row[1]]


KLIPPER = "".join(f"{21012.5 + k / 3200:.6f},{k % 7 - 3}.25,{k % 5},9806.65\n" for k in range(500))


@pytest.mark.parametrize("above", ["", "# accelerometer of axis x\n# chip: adxl345, 3200 Hz\n"])
def test_the_header_in_a_comment_gives_the_names(tmp_path, above):
    log = opened(tmp_path, f"{above}#time,accel_x,accel_y,accel_z\n{KLIPPER}")
    delimiter, columns, _ = sniffed(log.path)
    assert delimiter == ","
    assert names(log) == [(name.lstrip("#"), "") for name in columns]
    assert log.rate_hz == 3200


@pytest.mark.parametrize("delimiter", [" ", ",", ";", "\t"])
@pytest.mark.parametrize(
    ("header", "expected"),
    [
        ("t n u v", [("t", ""), ("n", ""), ("u", ""), ("v", "")]),
        ("t, n, u, v", [("t", ""), ("n", ""), ("u", ""), ("v", "")]),
        ("drive 7\nt [s] n u [V] v (A)", [("t", "s"), ("n", ""), ("u", "V"), ("v", "A")]),
        ("t n u v\n[s] [1] [V] [A]", [("t", "s"), ("n", "1"), ("u", "V"), ("v", "A")]),
    ],
)
def test_the_header_of_numpy_savetxt_gives_the_names(tmp_path, header, delimiter, expected):
    table = np.c_[np.arange(50) / 1000, np.arange(50), np.ones(50), np.arange(50) ** 2]
    np.savetxt(tmp_path / "log.txt", table, header=header, delimiter=delimiter)
    log = open_log(tmp_path / "log.txt")
    assert (names(log), log.rate_hz) == (expected, 1000)
    assert samples(log, "v") == table[:, 3].tolist()


@pytest.mark.parametrize("comment", ["# recorded on Monday", "# 0.1 0.2", "# u,u", "#", "# a: b:"])
def test_a_comment_that_names_no_columns_is_not_a_header(tmp_path, comment):
    log = opened(tmp_path, f"{comment}\n0,1\n1,2\n2,3\n", rate_hz=1)
    assert [name for name, _ in names(log)] == ["c1", "c2"]


@QUICK
@given(
    st.lists(st.sampled_from(["number", "word", "mixed"]), min_size=2, max_size=7).filter(lambda k: "number" in k),
    st.sampled_from([",", ";", "\t"]),
    st.data(),
)
def test_columns_of_text_are_skipped_and_the_header_remains(tmp_path, kinds, delimiter, data):
    cells = {"number": st.floats(-9, 9).map(repr), "word": WORDS}
    columns = [data.draw(st.lists(cells.get(kind, WORDS), min_size=24, max_size=24)) for kind in kinds]
    for column, kind in zip(columns, kinds):
        for row in range(2, 24) if kind == "mixed" else ():
            column[row] = data.draw(st.sampled_from(["0", column[row]]))
    header = [f"{kind}_{at}" for at, kind in enumerate(kinds)]
    lines = [delimiter.join(row) for row in [header, *zip(*columns)]]
    log = opened(tmp_path, "\n".join(lines) + "\n", rate_hz=1)
    assert [name for name, _ in names(log)] == [name for name in header if name.startswith("number")]
    assert [skipped.name for skipped in log.skipped] == [name for name in header if not name.startswith("number")]
    found, columns_found, types = sniffed(log.path)
    assert (found, columns_found) == (delimiter, header)
    assert {name for name, type_ in zip(header, types) if type_ == "VARCHAR"} == {s.name for s in log.skipped}


def blackbox(flags: list[str]) -> str:
    head = "loopIteration, time (us), axisP[0], vbatLatest (V), flightModeFlags (flags), failsafePhase (flags)\n"
    return head + "".join(f"{4 * k}, {1000 * k}, {k % 9}, 15.1, {flag}, IDLE\n" for k, flag in enumerate(flags))


@pytest.mark.parametrize("modes", [range(100, 300), [0], [900], range(900, 1000)])
def test_flags_in_some_rows_only_leave_the_other_channels_readable(tmp_path, modes):
    """Betaflight's decoded blackbox prints 0 for "no flag"; the words may begin far down."""
    log = opened(tmp_path, blackbox(["ANGLE_MODE|HORIZON" if k in modes else "0" for k in range(1000)]))
    found = inspect(log.path)
    assert [(channel.name, channel.unit) for channel in found.contents.channels] == [
        ("loopIteration", ""), ("time", "us"), ("axisP[0]", ""), ("vbatLatest", "V"),
    ]  # fmt: skip
    assert {skipped.name for skipped in found.skipped} == {"flightModeFlags", "failsafePhase"}
    assert (log.rate_hz, samples(log, "axisP[0]")[10]) == (1000, 1)


def test_text_in_a_channel_that_was_asked_for_is_still_refused(tmp_path):
    log = opened(tmp_path, blackbox(["ARM" if k == 900 else "0" for k in range(1000)]))
    with refused(RecordingError, "cell-not-a-number", line=902, value="ARM"):
        inspect(log.path, excitation="axisP[0]", output="flightModeFlags")


@pytest.mark.parametrize(
    "name", ["failsafePhase", "failsafePhase (flags)", "loopIteration + failsafePhase", "2*failsafePhase"]
)
def test_the_request_for_a_column_of_text_says_why_it_was_left_out(tmp_path, name):
    log = opened(tmp_path, blackbox(["0"] * 100))
    with pytest.raises(RecordingError, match=r"failsafePhase.* was left out: it contains text; name a channel of n"):
        log.blocks([name])
    with pytest.raises(RecordingError, match=r"failsafePhase.* was left out: it contains text; name a channel of n"):
        open_log(log.path, channels=[name])


def test_a_log_of_vesc_tool_has_its_time_in_ms_today(tmp_path):
    rows = "".join(f"{36_000_000 + 20 * k};50.{k % 9};{k * 10};FAULT_CODE_NONE;\n" for k in range(100))
    log = opened(tmp_path, f"ms_today;input_voltage;erpm;fault;\n{rows}")
    assert [name for name, _ in names(log)] == ["ms_today", "input_voltage", "erpm"]
    assert [skipped.name for skipped in log.skipped] == ["fault"]
    assert (log.rate_hz, log.timing.unit) == (50, "ms")


@pytest.mark.parametrize("first", ["0.0 0.0 0", "0.0\t0.0\t0", "0.0  0.0 0 "])
@pytest.mark.parametrize("end", ["", "\x1a", "\r\n\x1a", " ", " \r\n", "\r\n\r\n\x1a\r\n", "\x1a\x1a"])
def test_labview_text_with_a_first_row_of_blanks_and_any_end(tmp_path, first, end):
    rows = "\r\n".join(f"{k / 1000}\t{k}.5\t{k % 2}" for k in range(1, 60))
    log = opened(tmp_path, f"time\tposition\tstate\r\ns\tmm (a (b))\t-\r\n{first}\r\n{rows}\r\n{end}")
    assert names(log) == [("time", "s"), ("position", "mm (a (b))"), ("state", "")]
    assert (log.rate_hz, samples(log, "position")) == (1000, [0, *(k + 0.5 for k in range(1, 60))])


def test_a_final_ctrl_z_ends_the_last_number(tmp_path):
    log = opened(tmp_path, "t,u\n0,1\n1,2\n2,3\x1a", rate_hz=1)
    assert samples(log, "u") == [1, 2, 3]
    rows = "".join(f"{k},1,1\n" for k in range(300))
    with refused(RecordingError, "cell-not-a-number", line=302, value="1\x1a2"):
        samples(opened(tmp_path, f"t,u,v\n{rows}300,1\x1a2,1\n301,3,1\n", rate_hz=1), "u")


def test_brackets_inside_the_brackets_of_a_unit(tmp_path):
    for header in ("t [s];a [m/(s^2)];x (N (rms));y [m/[s]]\n", "t;a;x;y\n[s];[m/(s^2)];(N (rms));[m/[s]]\n"):
        log = opened(tmp_path, header + "0;1;2;3\n0,5;2;3;4\n")
        assert names(log) == [("t", "s"), ("a", "m/s²"), ("x", "N (rms)"), ("y", "m/[s]")]
