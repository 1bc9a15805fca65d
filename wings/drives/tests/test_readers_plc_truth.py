"""Exports of measuring and PLC tools as text: TwinCAT Scope, LabVIEW measurement files, CODESYS."""

from __future__ import annotations

import io

import numpy as np
import pytest

from livebode.core import RecordingError
from livebode.sources import Dialect, open_log
from livebode.sources.delimited import Tidied
from tests.support.errors import refused
from tests.support.real_recordings import recording
from tests.support.recordings import write_scope, write_trace
from tests.support.scope_project import Acquired, write_project


def values(log, name):
    return np.concatenate([block[name] for block in log.blocks([name])])


def group(rate_hz, samples, **channels):
    time = np.arange(samples) / rate_hz
    return time, {name: (unit, time * gain) for name, (unit, gain) in channels.items()}


@pytest.mark.parametrize(
    ("delimiter", "decimal", "end"),
    [
        ("\t", ".", ""),
        ("\t", ",", "EOF"),
        (";", ",", ""),
        (",", ".", "EOF"),
        ("|", ".", ""),
        (":", ".", ""),
        (" ", ",", "EOF"),
    ],
)
def test_every_dialect_of_twincat_scope_gives_names_units_and_time(tmp_path, delimiter, decimal, end):
    path = tmp_path / "scope.csv"
    write_scope(path, [group(1000, 300, pos=("mm", 2), vel=("", 3))], delimiter, decimal, end)
    log = open_log(path)
    assert [(channel.name, channel.source_unit) for channel in log.channels] == [
        ("t", "ms"),
        ("pos", "mm"),
        ("vel", ""),
    ]
    assert (log.rate_hz, log.samples, log.format) == (1000, 300, "twincat")
    for name in ("vel", "MAIN.vel"):
        np.testing.assert_array_equal(values(log, name), np.arange(300) / 1000 * 3)


def test_a_twincat_export_without_the_lines_of_its_file_is_read_alike(tmp_path):
    path = tmp_path / "scope.csv"
    write_scope(path, [group(1000, 300, pos=("mm", 2))])
    path.write_text(path.read_text().partition("\n\n\n")[2])
    log = open_log(path)
    assert [(channel.name, channel.source_unit) for channel in log.channels] == [("t", "ms"), ("pos", "mm")]
    assert (log.rate_hz, log.samples) == (1000, 300)


def test_a_twincat_export_without_any_header_is_a_table_that_may_end_with_eof(tmp_path):
    path = tmp_path / "scope.csv"
    write_scope(path, [group(1000, 300, pos=("mm", 2))], decimal=",", end="EOF")
    path.write_text(path.read_text().rpartition("\n\n")[2])
    log = open_log(path, time="c1 [ms]")
    assert (log.format, log.rate_hz) == ("csv", 1000)
    np.testing.assert_array_equal(values(log, "c2"), np.arange(300) / 1000 * 2)


def test_a_scope_project_gives_what_its_charts_show(tmp_path):
    """Names, scaling and units of the charts; variables that no chart shows; what ends after the record is left out."""
    time_s, count = np.arange(300) / 1000, np.arange(300)
    slow_s = np.arange(60) / 200 + 0.0003
    given = [
        Acquired("MAIN.r", time_s, count.astype("<f4") / 8, "r", "mm (Length)", 2.0, 1.0, -10.0, 10.0),
        Acquired("MAIN.n", time_s, count.astype("<i2"), "r", "(None)"),
        Acquired("MAIN.hidden", time_s, count.astype("<u8") * 3),
        Acquired("MAIN.slow", slow_s, np.arange(60.0), "slow"),
        Acquired("MAIN.packed", time_s, count.astype("<f4"), "packed", compression="Compressed"),
        Acquired("MAIN.text", time_s, count.astype("<u8"), "text", type="STRING"),
        Acquired("MAIN.bit", time_s, count.astype("<u8"), "bit", bits=4),
    ]
    path = tmp_path / "project.svdx"
    write_project(path, given, after_s=0.01)
    log = open_log(path)
    assert [(c.name, c.source_unit) for c in log.channels] == [("MAIN.r", "mm"), ("MAIN.n", ""), ("hidden", "")]
    assert (log.rate_hz, log.samples, log.other_clocks) == (1000, 290, {"slow.t": ("slow",)})
    assert [skipped.name for skipped in log.skipped] == ["packed", "text", "bit"]
    np.testing.assert_array_equal(values(log.as_written(), "MAIN.r"), -10 * (2 * count[:290] / 8 + 1) + 10)
    np.testing.assert_array_equal(values(log, "MAIN.n"), count[:290])
    np.testing.assert_array_equal(values(open_log(path, time="slow.t"), "slow"), np.arange(58))


def test_a_scope_project_and_its_export_give_the_same():
    """Written by TwinCAT. The export has raw values, to which the factors in its header belong."""
    project, export = (recording(f"twincat-scope/tc3_scope_3_4_3145_3{end}") for end in (".svdx", "-default.csv"))
    scaled = {"func_scaled": (-1, 1), "func_scaled_int": (-1, 1), "func_units_scaled": (-10, 10)}
    assert open_log(project).clock_kind == "utc"
    for time in (None, "func_OS.t", "func_freesample.t"):
        log, text = open_log(project, time=time), open_log(export, time=time)
        assert (log.rate_hz, log.samples) == (text.rate_hz, text.samples)
        for channel in text.channels[1:]:
            factor, offset = scaled.get(channel.name, (1, 0))
            assert channel in log.channels
            np.testing.assert_allclose(values(log, channel.name), values(text, channel.name) * factor + offset, 1e-6)


def test_names_with_blanks_between_blanks_are_read_as_their_symbols(tmp_path):
    """Nothing shows where such a name ends, except where it is the only one of its time column."""
    path = tmp_path / "scope.csv"
    head = [
        'Name "a scope"\nFile "a.csv"\n\n\nName my pos vel Name motor current',
        "SymbolName MAIN.x MAIN.x SymbolName MAIN.i",
        "Unit mm (Length) (None) Unit A (Electric current)",
        "Unit ScaleFactor 1 1 Unit ScaleFactor 1",
    ]
    first = [f"{k} {2 * k} {3 * k} {k + 0.5} {k}" for k in range(100)]
    second = [f"      {k + 0.5} {k}" for k in range(100, 140)]  # a blank is an empty cell, too
    path.write_text("\n".join([*head, "", *first, *second]) + "\n")
    log = open_log(path)
    assert [(c.name, c.source_unit) for c in log.channels] == [("t", "ms"), ("MAIN.x", "mm"), ("MAIN.x (2)", "")]
    np.testing.assert_array_equal(values(log, "MAIN.x (2)"), 3 * np.arange(100))
    other = open_log(path, channels=["motor current"])
    assert (other.samples, other.channels[1].unit) == (140, "A")
    np.testing.assert_array_equal(values(other, "motor current"), np.arange(140))


def test_time_columns_of_each_channel_with_equal_times_are_one(tmp_path):
    path = tmp_path / "scope.csv"
    write_scope(path, [group(1000, 300, pos=("mm", 2)), group(1000, 300, vel=("mm/s", 3))])
    log = open_log(path)
    assert [channel.name for channel in log.channels] == ["t", "pos", "vel"]
    assert log.skipped == ()


def test_channels_of_other_sample_times_are_read_on_request(tmp_path):
    """A task of 0.2 ms beside one of 1 ms; its lines are longer in number and shorter in length."""
    path = tmp_path / "scope.csv"
    fast, slow = group(5000, 1500, current=("A", 5)), group(1000, 300, pos=("mm", 2), vel=("", 3))
    write_scope(path, [fast, slow])
    whole, other = open_log(path, channels=["pos"]), open_log(path, channels=["MAIN.current"])
    assert (whole.rate_hz, whole.samples, other.rate_hz, other.samples) == (1000, 300, 5000, 1500)
    np.testing.assert_array_equal(values(whole.as_written(), "pos"), np.arange(300) / 1000 * 2)
    np.testing.assert_array_equal(values(other, "current"), np.arange(1500) / 5000 * 5)
    assert other.other_clocks == {"t": ("pos", "vel")}
    assert whole.other_clocks == {"current.t": ("current",)}


def test_channels_of_one_length_and_other_times_have_their_own_clock(tmp_path):
    path = tmp_path / "scope.csv"
    shifted = (np.arange(300) / 1000 - 0.0004, {"late": ("", np.arange(300.0))})
    write_scope(path, [group(1000, 300, pos=("mm", 2), vel=("", 3)), shifted])
    log = open_log(path)
    assert [channel.name for channel in log.channels] == ["t", "pos", "vel"]
    assert log.other_clocks == {"late.t": ("late",)}
    late = open_log(path, channels=["late"])
    assert next(late.blocks()).origin_s == -0.0004
    np.testing.assert_array_equal(values(late, "late"), np.arange(300.0))


def test_an_export_without_channels_is_refused(tmp_path):
    path = tmp_path / "scope.csv"
    path.write_text("Name\tscope\nFile\tx.csv\n\n0\t1\n", encoding="utf-8")
    with refused(RecordingError, "channel-missing", path=str(path)):
        open_log(path)
    path.write_text("Name\tscope\nFile\tx.csv\n", encoding="utf-8")
    with refused(RecordingError, "table-missing", path=str(path)):
        open_log(path)


LVM = """LabVIEW Measurement\t
Writer_Version\t2
Separator\tTab
Decimal_Separator\t,
Multi_Headings\tYes
X_Columns\t{columns}
Time_Pref\tRelative
Operator\tme
***End_of_Header***\t
\t
Channels\t2\t\t
Samples\t200\t200\t
Date\t2026/01/05\t2026/01/05\t
Y_Unit_Label\t{units}\t
X_Dimension\tTime\tTime\t
X0\t0,0000000000000000E+0\t0,0000000000000000E+0\t
Delta_X\t0,000500\t0,000500\t
***End_of_Header***\t\t\t
"""


@pytest.mark.parametrize(
    ("columns", "header", "units", "row"),
    [
        ("One", "X_Value\tspeed\tiq\tComment", "rad/s\tA", "{t}\t{a}\t{b}"),
        ("No", "X_Value\tspeed\tiq\tComment", "rad/s\tA", "\t{a}\t{b}\t"),
        ("Multi", "X_Value\tspeed\tX_Value\tiq\tComment", "rad/s\t\tA", "{t}\t{a}\t{t}\t{b}"),
    ],
)
def test_a_labview_measurement_file_gives_names_units_and_rate(tmp_path, columns, header, units, row):
    path = tmp_path / "log.lvm"
    rows = [row.format(t=f"{k / 2000:.6f}", a=f"{k * 0.5:.6f}", b=f"{k * 0.25:.6f}") for k in range(200)]
    rows[0] = rows[0].rstrip("\t") + "\tbegin of the measurement"
    text = LVM.format(columns=columns, units=units) + "\n".join([header, *(line.replace(".", ",") for line in rows)])
    path.write_text(text + "\n", encoding="utf-8")
    log = open_log(path)
    assert [(c.name, c.source_unit) for c in log.channels if c.name != "X_Value"] == [("speed", "rad/s"), ("iq", "A")]
    assert (log.rate_hz, log.skipped) == (2000, ())
    np.testing.assert_array_equal(values(log, "iq"), np.arange(200) * 0.25)


def test_a_second_segment_of_a_labview_file_is_refused_with_its_line(tmp_path):
    path = tmp_path / "log.lvm"
    text = LVM.format(columns="No", units="V\tV") + "X_Value\ta\tb\tComment\n" + "\t1,0\t2,0\n" * 20
    path.write_text(text + "Channels\t2\nSamples\t20\n", encoding="utf-8")
    with refused(RecordingError, "cell-not-a-number", line=40):
        values(open_log(path), "a")


def test_a_trace_of_codesys_2_as_text_gives_its_variables(tmp_path):
    path = tmp_path / "trace.txt"
    rows = "".join(f"{k} {2 * k} 1\n" for k in range(100))
    path.write_text(f"CoDeSys Trace\nD:\\PROJECTS\\AXIS.PRO\nCycle PLC_PRG.rPos PLC_PRG.bOn\n{rows}", encoding="utf-8")
    log = open_log(path, rate_hz=1000)
    assert [channel.name for channel in log.channels] == ["Cycle", "PLC_PRG.rPos", "PLC_PRG.bOn"]
    np.testing.assert_array_equal(values(log, "PLC_PRG.rPos"), 2 * np.arange(100.0))


@pytest.mark.parametrize(
    ("flags", "unit_s"),
    [("Flags; 16", 1e-3), ("Flags; 20", 1e-3), ("Flags; 32", 1e-6), ("Flags; 36", 1e-6), ("", 1e-3)],
)
def test_a_trace_of_codesys_3_gives_its_variables_with_their_clocks(tmp_path, flags, unit_s):
    """Each has its own times; where they are equal there is one clock. The flags contain the unit of the times."""
    path = tmp_path / "trace.csv"
    fast, slow = np.arange(300) * 0.001 / unit_s, np.arange(40) * 0.02 / unit_s
    variables = {
        "PLC_PRG.rPos": (fast, (np.arange(300) * 0.5).tolist()),
        "PLC_PRG.bOn": (fast, ["TRUE", "FALSE"] * 150),
        "PLC_PRG.rTemp": (slow, np.arange(40.0).tolist()),
        "PLC_PRG.sState": (slow, ["running; fine"] * 40),
        "PLC_PRG.rNever": ([], []),
    }
    write_trace(path, variables, flags)
    log = open_log(path)
    assert [(c.name, c.source_unit) for c in log.channels[1:]] == [("PLC_PRG.rPos", ""), ("PLC_PRG.bOn", "")]
    assert (log.rate_hz, log.format, log.other_clocks) == (1000, "codesys", {"PLC_PRG.rTemp.t": ("PLC_PRG.rTemp",)})
    assert [skipped.name for skipped in log.skipped] == ["PLC_PRG.sState", "PLC_PRG.rNever"]
    np.testing.assert_array_equal(values(log, "PLC_PRG.rPos"), np.arange(300) * 0.5)
    np.testing.assert_array_equal(values(log, "PLC_PRG.bOn"), [1, 0] * 150)
    other = open_log(path, channels=["PLC_PRG.rTemp"])
    assert (other.rate_hz, other.samples) == (50, 40)


def test_text_in_a_trace_of_codesys_3_names_its_line(tmp_path):
    path = tmp_path / "trace.csv"
    write_trace(path, {"a": (range(100), range(100)), "b": (range(100), [*range(50), "x", *range(49)])})
    assert len(values(open_log(path), "a")) == 100
    with refused(RecordingError, "cell-not-a-number", line=163, value="x"):
        values(open_log(path), "b")


def test_short_lines_of_a_wide_table_are_completed_in_small_pieces():
    """A table of 18,000 columns whose lines have one cell grows 9,000 times; it must not do so at once."""
    dialect = Dialect("\t", False, ".", ragged=True).with_headings([f"c{k}" for k in range(18_000)])
    raw = io.BytesIO(b"1\n" * 100_000)
    first = Tidied(raw, dialect).read(1 << 26)
    assert raw.tell() <= 1 << 12
    assert first[:18_000] == b"1" + b"\t" * 17_999
    assert len(first) < 1 << 26
