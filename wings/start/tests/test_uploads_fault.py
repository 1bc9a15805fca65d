"""Uploads that end early, are foreign, too long or have no room: one sentence, and nothing remains."""

from __future__ import annotations

import asyncio
import contextlib
import os
import resource
import socket
import subprocess
import sys
import time
import tracemalloc
from collections.abc import AsyncIterator, Iterator
from http.client import HTTPResponse
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import quote, urlsplit

import pytest

from livebode.core import OutputError, ServerError
from livebode.dashboard import ServerSettings, listener
from livebode_start import uploads
from livebode_start.uploads import UPLOAD_BYTES_MAX, Uploads
from livebode_start.workspace import Workspace
from tests.support.browser import Tab, chromium, until
from tests.support.errors import refused
from tests.support.guarded import TOKEN, VIEWER
from tests.support.many_runs import ask
from tests.support.peers.peer import PATIENCE_S
from tests.support.servo_csv import write_servo
from tests.support.start_pages import send, start_page

LOCKED = ServerSettings("127.0.0.1", 0, token=TOKEN, viewer_token=VIEWER)


def contents(folder: Path) -> list[str]:
    """`os.walk` passes over a folder that the server removes meanwhile; `Path.rglob` raises."""
    paths = [Path(parent, name) for parent, folders, files in os.walk(folder) for name in folders + files]
    return sorted(path.relative_to(folder).as_posix() for path in paths)


def body(sender: socket.socket) -> bytes:
    """Of the whole answer, in however many parts it comes."""
    response = HTTPResponse(sender)
    response.begin()
    return response.read()


def test_a_foreign_file_gets_the_sentence_of_the_reader_and_does_not_remain(tmp_path: Path) -> None:
    (tmp_path / "drawing.pdf").write_bytes(b"%PDF-1.7\n" + bytes(2000))
    with start_page(tmp_path / "runs") as url, chromium() as browser, Tab(browser, url, wait=False) as tab:
        tab.page.wait_for_selector(".drop")
        tab.page.set_input_files("#file", tmp_path / "drawing.pdf")
        tab.page.wait_for_function("() => document.querySelector('.start .wrong').textContent")
        assert tab.page.inner_text(".start .wrong") == (
            "drawing.pdf is not a recording, but a PDF document; name the recording"
        )
    assert contents(tmp_path / "runs") == []


def test_a_damaged_recording_of_the_directory_gets_the_sentence_of_the_reader(tmp_path: Path) -> None:
    (tmp_path / "cut.parquet").write_bytes(b"PAR1" + bytes(100))
    address = "measure?recording=cut.parquet"
    with start_page(tmp_path) as url, chromium() as browser, Tab(browser, url + address, wait=False) as tab:
        tab.page.wait_for_selector("#notice:visible")
        sentence = tab.page.inner_text("#notice")
    assert "cut.parquet" in sentence
    assert str(tmp_path) not in sentence


def test_a_recording_without_a_rate_asks_for_it(tmp_path: Path) -> None:
    lines = write_servo(tmp_path / "servo.csv").read_text().splitlines()
    rows = [line.partition(",")[2] for line in lines]
    (tmp_path / "rateless.csv").write_text("\n".join(rows) + "\n")
    address = "measure?recording=rateless.csv"
    with start_page(tmp_path) as url, chromium() as browser, Tab(browser, url + address, wait=False) as tab:
        tab.page.fill("#rate-hz", "2000")
        tab.page.click("#rate button")
        tab.page.wait_for_selector("#measure:enabled")
        assert "rate_hz = 2000" in (tab.page.text_content("#text") or "")


def test_an_upload_that_is_broken_off_leaves_nothing(tmp_path: Path) -> None:
    data = write_servo(tmp_path / "servo.csv").read_bytes()
    with start_page(tmp_path / "runs") as url:
        parts = urlsplit(url)
        head = f"POST /api/upload?name=servo.csv HTTP/1.1\r\nHost: {parts.netloc}\r\nOrigin: {url.rstrip('/')}\r\n"
        with socket.create_connection((parts.hostname, parts.port), PATIENCE_S) as sender:
            sender.sendall(f"{head}Content-Length: {len(data)}\r\n\r\n".encode() + data[: len(data) // 2])
            until(lambda: any((tmp_path / "runs").glob(".*/servo.csv")), "the first part")
        until(lambda: contents(tmp_path / "runs") == [], "its removal")
        assert send(url, "/api/upload?name=servo.csv", data) == (200, {"recording": "servo.csv"})
    assert (tmp_path / "runs" / "servo.csv").read_bytes() == data


@contextlib.contextmanager
def upload_begun(url: str, folder: Path, data: bytes) -> Iterator[socket.socket]:
    """Half of an upload has come, and its sender is still there."""
    parts = urlsplit(url)
    head = f"POST /api/upload?name=servo.csv HTTP/1.1\r\nHost: {parts.netloc}\r\nOrigin: {url.rstrip('/')}\r\n"
    with socket.create_connection((parts.hostname, parts.port), PATIENCE_S) as sender:
        sender.sendall(f"{head}Content-Length: {len(data)}\r\n\r\n".encode() + data[: len(data) // 2])
        until(lambda: any(folder.glob(".upload.partial-*/servo.csv")), "the first part")
        yield sender


def test_the_part_that_a_killed_server_received_is_removed_at_the_next_start_and_nothing_else(tmp_path: Path) -> None:
    data = write_servo(tmp_path / "servo.csv").read_bytes()
    folder = tmp_path / "runs"
    command = [sys.executable, "-c", "from livebode.cli import main; main()", "view", str(folder), "--port=0"]
    with subprocess.Popen([*command, "--no-browser"], stderr=subprocess.PIPE, text=True) as server:
        assert server.stderr is not None
        url = server.stderr.readline().split()[-1]
        with upload_begun(url, folder, data):
            server.kill()
    (killed,) = folder.iterdir()
    foreign = {".upload.partial-00000000/notes.txt": b"mine", ".upload.partial-notes": b"mine"}
    for name, content in foreign.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(content)
    (folder / ".upload.partial-11111111").symlink_to(tmp_path)
    wrong = folder / ".upload.partial-22222222"
    wrong.mkdir()
    (wrong / "livebode-upload.json").write_text('{"recording": "../../servo.csv"}')
    with start_page(folder) as url:
        assert not killed.exists()
        with upload_begun(url, folder, data) as sender, start_page(folder):  # another server starts meanwhile
            sender.sendall(data[len(data) // 2 :])
            assert b'"servo.csv"' in body(sender)
    assert (folder / "servo.csv").read_bytes() == data == (tmp_path / "servo.csv").read_bytes()
    assert {name: (folder / name).read_bytes() for name in foreign} == foreign
    assert (folder / ".upload.partial-11111111").is_symlink()
    assert wrong.exists()


def test_an_internal_error_of_the_server_is_a_sentence_on_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise ZeroDivisionError

    log = write_servo(tmp_path / "servo.csv")
    monkeypatch.setattr(Workspace, "free_name", fail)
    monkeypatch.setattr(Workspace, "path", fail)
    with start_page(tmp_path / "runs") as url, chromium() as browser:
        with Tab(browser, url, wait=False) as tab:
            tab.page.set_input_files("#file", log)
            tab.page.wait_for_function("() => document.querySelector('.start .wrong').textContent")
            sentence = tab.page.inner_text(".start .wrong")
        with Tab(browser, url + "measure?recording=servo.csv", wait=False) as tab:
            tab.page.wait_for_selector("#notice:visible")
            assert tab.page.inner_text("#notice") == sentence
    assert sentence == "Internal error of the server (500); its terminal shows the cause. Try again."


def test_a_second_recording_of_the_same_name_replaces_nothing(tmp_path: Path) -> None:
    data = write_servo(tmp_path / "servo.csv").read_bytes()
    with start_page(tmp_path / "runs") as url:
        names = [send(url, "/api/upload?name=servo.csv", data + b"\n" * k)[1]["recording"] for k in range(3)]
    assert names == ["servo.csv", "servo-2.csv", "servo-3.csv"]
    assert [(tmp_path / "runs" / name).stat().st_size - len(data) for name in names] == [0, 1, 2]


def test_an_upload_may_last_as_long_as_its_parts_come(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The listener gives any other request its whole time for everything."""
    monkeypatch.setattr(listener, "REQUEST_S", 1.0)
    data = write_servo(tmp_path / "servo.csv", periods=4).read_bytes()
    with start_page(tmp_path / "runs") as url:
        parts = urlsplit(url)
        head = f"POST /api/upload?name=servo.csv HTTP/1.1\r\nHost: {parts.netloc}\r\nOrigin: {url.rstrip('/')}\r\n"
        with socket.create_connection((parts.hostname, parts.port), PATIENCE_S) as sender:
            sender.sendall(f"{head}Content-Length: {len(data)}\r\n\r\n".encode())
            step = -(-len(data) // 20)
            for first in range(0, len(data), step):  # 4 s in all
                time.sleep(0.2)
                sender.sendall(data[first : first + step])
            assert b'"servo.csv"' in body(sender)
        with socket.create_connection((parts.hostname, parts.port), PATIENCE_S) as silent:
            silent.sendall(f"{head}Content-Length: {len(data)}\r\n\r\n".encode() + data[:100])
            assert silent.recv(100) == b""
        until(lambda: contents(tmp_path / "runs") == ["servo.csv"], "the removal of the part")


def received(folder: Path, size_bytes: int | None, pieces: int = 0, name: str = "long.csv") -> str:
    async def parts() -> AsyncIterator[bytes]:
        for number in range(pieces):
            yield b"0.1,0.2,0.3\n" * 5000 if number else b"t [s],u,y\n"

    return asyncio.run(Uploads(Workspace(folder)).receive(name, size_bytes, parts()))


def test_a_long_recording_is_never_in_memory(tmp_path: Path) -> None:
    size = 10 + 60_000 * 1000
    tracemalloc.start()
    try:
        received(tmp_path, size, 1001)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert (tmp_path / "long.csv").stat().st_size == size
    assert peak < size / 6


def test_limits_are_said_with_their_values_before_anything_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with refused(ServerError, "upload-too-long", bytes=UPLOAD_BYTES_MAX + 1):
        received(tmp_path, UPLOAD_BYTES_MAX + 1)
    with refused(ServerError, "request-malformed"):
        received(tmp_path, None)
    monkeypatch.setattr(uploads.shutil, "disk_usage", lambda _: SimpleNamespace(free=10_000_000))
    with refused(ServerError, "disk-full", free_bytes=10_000_000):
        received(tmp_path, 1000, 1)
    assert contents(tmp_path) == []


def test_a_disk_that_takes_no_more_is_one_sentence_and_nothing_remains(tmp_path: Path) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
    try:
        with refused(OutputError, "not-written", reason="the file has its largest size"):
            received(tmp_path, 10 + 60_000 * 40, 41)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert contents(tmp_path) == []


@pytest.mark.parametrize(("token", "status"), [("", 401), (VIEWER, 403), (TOKEN, 200)])
def test_only_an_operator_uploads_configures_and_measures(tmp_path: Path, token: str, status: int) -> None:
    data = write_servo(tmp_path / "servo.csv").read_bytes()
    choices = {"recording": "servo.csv", "signals": {"input": "torque", "output": "motor_speed"}}
    with start_page(tmp_path / "runs", LOCKED) as url:
        before = contents(tmp_path / "runs") if (tmp_path / "runs").exists() else []
        found = [
            send(url, "/api/upload?name=servo.csv", data, token)[0],
            *(ask(url, f"/api/{name}", choices, token=token)[0] for name in ("configuration", "measure")),
            *(ask(url, "/api/cancel", {"job": "none"}, token=token)[0] for _ in range(1)),
        ]
        assert found[:3] == [status] * 3
        assert found[3] == (status if status != 200 else 400)  # a job that does not exist
        if status != 200:
            assert (contents(tmp_path / "runs") if (tmp_path / "runs").exists() else []) == before


def test_another_origin_can_neither_upload_nor_measure(tmp_path: Path) -> None:
    data = write_servo(tmp_path / "servo.csv").read_bytes()
    with start_page(tmp_path / "runs") as url:
        for path in ("/api/upload?name=servo.csv", "/api/measure", "/api/configuration", "/api/cancel"):
            assert send(url, path, data, Origin="http://example.com")[0] == 403
        # A form of another page has no JSON, whatever its origin says.
        assert send(url, "/api/measure", b"{}", **{"Content-Type": "text/plain"})[0] == 400
    assert not (tmp_path / "runs").exists()


def test_get_changes_nothing(tmp_path: Path) -> None:
    folder = tmp_path / "runs"
    folder.mkdir()
    write_servo(folder / "servo.csv")
    before = [(path, path.stat().st_mtime_ns) for path in sorted(folder.iterdir())]
    with start_page(folder) as url:
        for path in (
            "/", "/measure?recording=servo.csv", "/api/recordings", "/api/recording?recording=servo.csv",
            "/api/preview?recording=servo.csv&channel=torque", "/api/job?id=x", "/api/runs",
        ):  # fmt: skip
            assert ask(url, path)[0] in (200, 400), path
        for path in ("/api/upload?name=x.csv", "/api/measure", "/api/configuration", "/api/cancel"):
            assert ask(url, path)[0] == 405
        for path in ("/api/recordings", "/api/recording?recording=" + quote("servo.csv")):
            with start_page(folder, LOCKED) as locked:
                assert ask(locked, path)[0] == 401
    assert [(path, path.stat().st_mtime_ns) for path in sorted(folder.iterdir())] == before
