"""`livebode` alone, and `livebode view` on a directory without a run: the start page, and help for scripts."""

from __future__ import annotations

import os
import pty
import re
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

from tests.support.command import livebode
from tests.support.served import served

MAIN = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); from livebode.cli import main; main()"


def at_terminal(folder: Path, *words: str, **variables: str) -> str:
    """What a person sees until the page is there and all that follows it at once; then Ctrl-C."""
    reader, terminal = pty.openpty()
    surroundings = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "SSH_CONNECTION")}
    process = subprocess.Popen(
        [sys.executable, "-c", MAIN, *words], cwd=folder, stdin=terminal, stdout=terminal, stderr=terminal,
        env=surroundings | variables,
    )  # fmt: skip
    os.close(terminal)
    shown = ""
    while not (found := re.search(r"is at (http\S+)\r\n", shown)):
        shown += os.read(reader, 4096).decode()
    assert b"livebode" in urllib.request.urlopen(found[1]).read()
    while "DISPLAY" in variables and "--no-browser" not in words and "opened" not in shown:
        shown += os.read(reader, 4096).decode()
    process.send_signal(signal.SIGINT)
    process.wait(60)
    os.close(reader)
    return shown


def test_alone_at_a_terminal_it_serves_the_directory_runs(tmp_path: Path) -> None:
    assert "opened" not in at_terminal(tmp_path)  # no screen
    assert not (tmp_path / "runs").exists()  # until there is something in it


def test_the_browser_opens_where_there_is_a_screen(tmp_path: Path) -> None:
    screen = {"DISPLAY": ":0", "BROWSER": "echo opened %s"}
    assert re.search(r"opened http://127\.0\.0\.1:\d+/", at_terminal(tmp_path, **screen))
    assert "opened" not in at_terminal(tmp_path, "view", "--no-browser", "--port", "0", **screen)
    assert "opened" not in at_terminal(tmp_path, "--no-browser", **screen)


def test_a_script_gets_the_help() -> None:
    found = livebode()
    assert (found.code, found.err) == (2, "")
    assert found.out.lstrip().startswith("Usage: livebode")


def test_the_usual_port_is_left_to_who_has_it(tmp_path: Path) -> None:
    """Two people of one computer, or two directories of one person."""
    first, second = tmp_path / "first", tmp_path / "second"
    for folder in (first, second):
        folder.mkdir()
    with served(first, "view", first) as (_, here), served(second, "view", second) as (_, there):
        assert here != there
        assert [b"livebode" in urllib.request.urlopen(url).read() for url in (here, there)] == [True, True]
