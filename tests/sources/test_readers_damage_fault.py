"""Damaged and truncated recordings, and any bytes: read or refused in one sentence, never another exception."""

from __future__ import annotations

import os
import random
import re
import sys
from functools import partial
from pathlib import Path

import can
import pytest
import scipy.io
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.support.bad_recordings import survives, text
from tests.support.recordings import (
    DBC,
    OWN_RATE,
    WRITERS,
    Mf4Writer,
    dspace,
    signals,
    with_time,
    write,
    write_dspace73,
    write_frames,
)

MODULES = sorted(WRITERS)
MAY_END_ANYWHERE = "asc", "codesys", "delimited", "lvm", "twincat", "ulog"
"""A table may end after any row, and a flight recorder when its battery is removed."""
ROUNDS = int(os.environ.get("LIVEBODE_FUZZ_ROUNDS", "150"))
"""Damaged files of each kind; raise it for a campaign."""
SLOW = "asc", "blf", "blf_plain", "mcap", "mdf", "mdf_frames", "rosbag", "ulog"
"""Kinds whose libraries take some milliseconds for a file: a third of the rounds."""


@pytest.mark.parametrize("module", MODULES)
def test_a_file_truncated_anywhere_is_read_or_refused(module, tmp_path):
    given = signals(200) if module in OWN_RATE else with_time(signals(200))
    whole = write(module, tmp_path, given).read_bytes()
    for keep in range(1, len(whole) - 3, max(1, len(whole) // 40)):
        path = text(tmp_path, whole[:keep], f"cut{Path(WRITERS[module][0]).suffix}")
        assert not survives(path) or module in MAY_END_ANYWHERE


@settings(max_examples=ROUNDS, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.binary(max_size=600),
    st.sampled_from(
        [
            "",
            "PAR1",
            "ARROW1\0\0",
            "PK\x03\x04",
            "<",
            "t,u\n0,1\n",
            "#t,u\n0,1\n",
            "\ufeff",
            "Name\tscope\nFile\tx\nName\tu\n0\t1\n",
            "LabVIEW Measurement\nX_Value\tu\n0\t1\n",
            "\x14" + 19 * "\0",
            "[key]; [value]\n0.Variable; u\n0.Data; \n; 0; 1\n; 1; 2\n",
        ]
    ),
)
def test_any_bytes_are_read_or_refused(tmp_path, content, head):
    path = text(tmp_path, head.encode() + content, "log.csv")
    survives(path, rate_hz=1000)


def damaged(whole: bytes, rng: random.Random) -> bytes:
    """The file with bytes changed, sizes blown up, pieces lost or put in, the end cut off."""
    raw = bytearray(whole)
    for _ in range(rng.choice([1, 1, 2, 3, 8, 30])):
        at = rng.randrange(len(raw)) if raw else 0
        what = rng.randrange(5)
        if what == 0:
            raw[at : at + 1] = rng.randbytes(1)
        elif what == 1 and raw:
            raw[at] ^= 1 << rng.randrange(8)
        elif what == 2:
            raw[at : at + 4] = rng.choice([b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\0\0"])
        elif what == 3:
            del raw[at : at + rng.randrange(1, 16)]
        else:
            raw[at:at] = rng.randbytes(rng.randrange(1, 8))
    return bytes(raw[: rng.randrange(len(raw))]) if raw and rng.random() < 0.15 else bytes(raw)


def seeds(module: str, folder: Path) -> bytes:
    if module == "struct":
        scipy.io.savemat(folder / "a.mat", dspace(50))
        return (folder / "a.mat").read_bytes()
    if module == "struct73":
        write_dspace73(folder / "a.mat", 50)
        return (folder / "a.mat").read_bytes()
    if module == "mdf_frames":
        write_frames(Mf4Writer, folder / "log.mf4", with_time(signals(50)))
        return (folder / "log.mf4").read_bytes()
    if module == "blf_plain":  # damage reaches the frames
        write_frames(partial(can.BLFWriter, compression_level=0), folder / "log.blf", with_time(signals(50)))
        return (folder / "log.blf").read_bytes()
    return write(module, folder, signals(50) if module in OWN_RATE else with_time(signals(50))).read_bytes()


@pytest.mark.parametrize("module", [*MODULES, "struct", "struct73", "blf_plain", "mdf_frames"])
def test_damaged_files_are_read_or_refused(module, tmp_path):
    whole = seeds(module, tmp_path)
    for round_ in range(ROUNDS // 3 if module in SLOW else ROUNDS):
        rng = random.Random(f"{module} {round_}")
        path = text(tmp_path, damaged(whole, rng) or b"x", "damaged.bin")
        survives(path, rate_hz=rng.choice([None, 4000.0]), time=rng.choice([None, "none"]))


@pytest.mark.parametrize(("module", "rounds"), [("mdf", (625, 805, 980, 1494)), ("ulog", (3, 13, 104, 157))])
def test_libraries_print_nothing_about_damaged_files(module, rounds, tmp_path, capsys):
    """asammdf and pyulog printed what they had found in these; standard output is still that of the process."""
    whole, output = seeds(module, tmp_path), sys.stdout
    for round_ in rounds:
        path = text(tmp_path, damaged(whole, random.Random(f"{module} {round_}")), "damaged.bin")
        survives(path, rate_hz=4000)
        assert sys.stdout is output
    assert capsys.readouterr() == ("", "")


def test_damaged_dbc_files_are_read_or_refused(tmp_path):
    path = write("blf", tmp_path, with_time(signals(20)))
    whole = (tmp_path / DBC).read_bytes()
    for round_ in range(ROUNDS // 3):
        rng = random.Random(f"dbc {round_}")
        raw = damaged(whole, rng) or b"x"
        at = rng.choice([match.start() for match in re.finditer(rb"\d", raw)] or [0])
        (tmp_path / DBC).write_bytes(raw[:at] + rng.choice([b"", b"", b"99", b"4000000000"]) + raw[at:])
        survives(path)
