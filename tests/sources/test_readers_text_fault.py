"""Tables in text that cannot be read: the reason with its line, and no thread that reads on after the end."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from livebode.core import RecordingError
from tests.support.bad_recordings import drain, refusal, text
from tests.support.errors import refused


@pytest.mark.parametrize(
    ("content", "code", "facts"),
    [
        ("t,u\n0,1\n0.1,abc\n0.2,3\n", "cell-not-a-number", {"line": 3, "channel": "u", "value": "abc"}),
        ("# x\n\nt,u\n0,1\n0.1,1\n0.2,3,4\n", "line-ragged", {"line": 6, "cells": 3, "columns": 2}),
        ("t,u\n0,1\n0.1,1\n0.2,3\n0.3", "line-ragged", {"line": 5, "cells": 1, "columns": 2}),
        ("t,u,u\n0,1,2\n0.1,1,2\n", "channel-duplicated", {"channel": "u", "columns": [2, 3]}),
        ("t,u\n", "table-missing", {"beginning": "t,u"}),
        ("\n\n", "table-missing", {}),
        ("just some prose\nand more of it\n", "table-missing", {}),
        (b"t,u\n\x00\x01\x02", "format-unknown", {"suffix": ".csv"}),
        (b"t,u\n" + b"0,1\n" * 1000 + b"\x00\x00", "format-unknown", {}),
        (bytes(range(256)) * 8, "format-unknown", {"suffix": ".csv", "beginning": "0001020304050607"}),
        ("1" * 300_000, "line-too-long", {"line": 1, "limit_bytes": 1 << 18}),
        ("", "empty", {}),
        ("t;u\n0;1.234,5\n1;2.345,6\n", "channel-missing", {}),
    ],
)
def test_unreadable_tables_are_refused_with_their_reason(tmp_path, content, code, facts):
    path = text(tmp_path, content)
    with refused(RecordingError, code, path=str(path), **facts):
        drain(path)


def test_a_table_without_channels_names_what_was_left_out(tmp_path):
    assert "('u': it contains text)" in str(refusal(text(tmp_path, "t;u\n0;1.234,5\n1;2.345,6\n")))


def test_text_far_down_is_found_with_its_line(tmp_path):
    lines = [f"{k / 1000},{k}" for k in range(200_000)]
    lines[150_000] = "150.0,1.2.3"
    with refused(RecordingError, "cell-not-a-number", line=150_002, value="1.2.3"):
        drain(text(tmp_path, "t,u\n" + "\n".join(lines)))


def test_a_ragged_row_with_invalid_utf8_is_refused(tmp_path):
    rows = "".join(f"{k},1\n" for k in range(100_000)).encode()
    with refused(RecordingError, "line-ragged", line=100_002):
        drain(text(tmp_path, b"t,u\n" + rows + b"\xff\xfe,1,2\n"), rate_hz=1)


def test_an_overlong_line_is_refused_with_its_number(tmp_path):
    rows = "".join(f"{k},1\n" for k in range(100_000))
    with refused(RecordingError, "line-too-long", line=100_002, limit_bytes=1 << 20):
        drain(text(tmp_path, f"t,u\n{rows}1,{'2' * 9_000_000}\n"), rate_hz=1)


SLOW_READ = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <time.h>
#include <unistd.h>
ssize_t read(int file, void *into, size_t size) {
    ssize_t (*real)(int, void *, size_t) = (ssize_t (*)(int, void *, size_t))dlsym(RTLD_NEXT, "read");
    struct timespec delay = {0, size < 1000000 ? 0 : 50000000};
    nanosleep(&delay, 0);
    return real(file, into, size);
}
"""

READ_ANOTHER_FILE_AFTER_THE_FIRST_ROWS = """
import sys
from pathlib import Path
from livebode.sources.delimited import DelimitedRecording
recording = DelimitedRecording(Path(sys.argv[1]))
chunks = recording.chunks(recording.columns, 1000)
next(chunks)
chunks.close()
with Path(sys.argv[1]).open("rb") as another:
    read = another.read()
sys.exit(len(read) != Path(sys.argv[1]).stat().st_size)
"""


def test_a_recording_left_early_takes_no_bytes_from_the_file_opened_next(tmp_path):
    """On a disk of 50 ms a read, threads that read ahead would still do so when the recording is closed."""
    recording = text(tmp_path, "t,u\n" + "".join(f"{k},1\n" for k in range(400_000)))
    (tmp_path / "slow.c").write_text(SLOW_READ)
    subprocess.run(["gcc", "-shared", "-fPIC", "slow.c", "-o", "slow.so", "-ldl"], cwd=tmp_path, check=True)
    finished = subprocess.run(
        [sys.executable, "-c", READ_ANOTHER_FILE_AFTER_THE_FIRST_ROWS, str(recording)],
        env={**os.environ, "LD_PRELOAD": str(tmp_path / "slow.so")},
        capture_output=True,
        text=True,
    )
    assert (finished.returncode, finished.stderr) == (0, "")


def test_a_program_that_ends_while_a_table_is_read_ahead_ends_as_it_would_without(tmp_path: Path) -> None:
    rows = "".join(f"{at:.6f},{at % 7},{at % 11}\n" for at in range(100_000))
    (tmp_path / "log.csv").write_text("t,w,y\n" + 15 * rows)
    program = (
        "from livebode.sources import open_log\nblocks = open_log('log.csv', rate_hz=4000, time='none').blocks(['w'])\n"
    )
    for _ in range(3):
        ended = subprocess.run([sys.executable, "-c", f"{program}next(blocks)"], cwd=tmp_path, stderr=subprocess.PIPE)
        assert (ended.returncode, ended.stderr) == (0, b"")
