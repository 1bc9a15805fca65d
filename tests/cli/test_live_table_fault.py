"""What the table of a live run shows on a narrow terminal: its sentences are whole."""

from __future__ import annotations

import os
import pty
import re
import signal
import socket
from pathlib import Path
from unittest import mock

from tests.support.forked import Command
from tests.support.peers.peer import PATIENCE_S

AXIS = """[source]
url = "udp://127.0.0.1:{port}"
rate_hz = 1000
timeout_s = 1

[signals]
excitation = "w"
input = "u"
output = "y"

[lines]
frequencies = "50,100"
window = 100
"""
CONTROL = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


def test_an_event_that_is_longer_than_its_column_is_whole_below_the_table(tmp_path: Path) -> None:
    """Nobody sends: the axis waits, and says so with a remedy."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    (tmp_path / "axis.toml").write_text(AXIS.format(port=port))
    reader, terminal = pty.openpty()
    with mock.patch.dict(os.environ, {"TERM": "xterm-256color", "COLUMNS": "80"}):
        process = Command("run", tmp_path / "axis.toml", "--out", tmp_path / "run", terminal=terminal)
    os.close(terminal)
    shown = ""
    with process:
        while "see below" not in (tables := CONTROL.sub("", shown).split("last event"))[-2 if len(tables) > 1 else 0]:
            shown += os.read(reader, 1 << 16).decode()
        process.send_signal(signal.SIGINT)
        process.wait(PATIENCE_S)
    os.close(reader)
    table = " ".join(tables[-2].split())
    assert re.search(r"see below axis: udp://127\.0\.0\.1:\d+: no samples .* check the address", table), table
    assert all(len(line.rstrip()) <= 80 for line in tables[-2].splitlines())
