"""Storages that fail: one sentence each, with the URL and what to do, and nothing left behind."""

import resource
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from livebode.core import LocationError
from livebode.locations import Upload, Url, find, local_copy, read_bytes, upload, write_whole
from tests.support.object_storage import BUCKET, at_address, object_storage


@pytest.fixture(scope="module")
def s3() -> Iterator[str]:
    with object_storage() as address:
        yield address


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where copies are downloaded to, to see what remains."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


def copy_fails(url: str, code: str) -> str:
    with pytest.raises(LocationError) as caught, local_copy(url):
        pass
    assert caught.value.code == f"location.{code}"
    assert url in str(caught.value)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.usefixtures("s3")
@pytest.mark.parametrize("name", ["nowhere/a.csv", f"{BUCKET}/missing.csv"])
def test_a_missing_bucket_or_key_is_not_found(name: str, temporary: Path) -> None:
    assert copy_fails(f"s3://{name}", "not-found") == f"there is nothing at s3://{name}; check bucket and name"
    assert not list(temporary.iterdir())


@pytest.mark.usefixtures("s3")
def test_a_pattern_in_a_missing_bucket_is_not_an_empty_list() -> None:
    with pytest.raises(LocationError, match="nothing at s3://nowhere"):
        find("s3://nowhere/**/*.csv")


@pytest.mark.usefixtures("s3")
def test_a_missing_bucket_is_not_created_by_writing() -> None:
    with pytest.raises(LocationError, match=r"nothing at s3://nowhere/a[.]json"):
        write_whole("s3://nowhere/a.json", b"{}")


def test_a_server_that_is_not_there_is_not_reachable() -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"http://127.0.0.1:{free.getsockname()[1]}"
    with at_address(address), pytest.MonkeyPatch.context() as patch:
        without_retries(patch)
        assert "check the network" in copy_fails("s3://hall/a.csv", "not-reachable")


def without_retries(patch: pytest.MonkeyPatch) -> None:
    """One attempt, since a test needs no patience."""
    import s3fs

    patch.setattr(s3fs.S3FileSystem, "retries", 1)


def test_without_credentials_it_says_where_they_are_expected(
    s3: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with at_address(s3):
        for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
            monkeypatch.delenv(name)
        monkeypatch.setenv("AWS_SHARED_CREDENTIALS_FILE", str(tmp_path / "none"))
        assert "docs/how-to/remote.md" in copy_fails("s3://hall/a.csv", "no-credentials")


@contextmanager
def answering(*answers: bytes) -> Iterator[str]:
    """A server that gives one of these answers to each connection and then closes it, the last one again and again."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            remaining = list(answers)
            while True:
                try:
                    connection, _ = server.accept()
                except OSError:
                    return
                with connection:
                    connection.recv(1 << 16)
                    connection.sendall(remaining.pop(0) if remaining[1:] else remaining[0])

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.getsockname()[1]}"
        finally:
            server.shutdown(socket.SHUT_RDWR)
            thread.join()


def http(status: str, body: bytes = b"", length: int | None = None) -> bytes:
    size = len(body) if length is None else length
    etag = 'ETag: "1"\r\nLast-Modified: Mon, 01 Jan 2024 00:00:00 GMT\r\n'
    return f"HTTP/1.1 {status}\r\n{etag}Content-Length: {size}\r\nConnection: close\r\n\r\n".encode() + body


def test_a_refusal_is_reported_as_one(temporary: Path) -> None:
    with answering(http("403 Forbidden")) as address, at_address(address):
        assert "ask for access" in copy_fails("s3://hall/a.csv", "denied")
    assert not list(temporary.iterdir())


def test_a_server_that_dies_within_a_file_leaves_nothing(temporary: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    without_retries(monkeypatch)
    with answering(http("200 OK", length=1000), http("200 OK", b"t,y\n", length=1000)) as address, at_address(address):
        assert "try again" in copy_fails("s3://hall/a.csv", "interrupted")
    assert not list(temporary.iterdir())


def test_a_file_that_changes_during_the_download_is_refused(temporary: Path) -> None:
    head, other = http("200 OK", length=4), http("200 OK", length=4).replace(b'"1"', b'"2"')
    with answering(head, http("200 OK", b"t,y\n"), other) as address, at_address(address):
        copy_fails("s3://hall/a.csv", "changed")
    assert not list(temporary.iterdir())


@pytest.mark.usefixtures("s3")
def test_a_full_disk_is_reported_with_the_directory_that_is_full(temporary: Path) -> None:
    write_whole("s3://hall/long.csv", bytes(20_000))
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (9_000, hard))
    try:
        sentence = copy_fails("s3://hall/long.csv", "no-space")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert str(temporary) in sentence
    assert "TMPDIR" in sentence
    assert not list(temporary.iterdir())


def test_an_upload_that_fails_leaves_no_run_there_and_the_local_one_here(tmp_path: Path) -> None:
    files = ("bode.svg", "run.json")
    for name in files:
        (tmp_path / name).write_text(name)
    with (
        answering(http("404 Not Found"), http("404 Not Found"), http("403 Forbidden")) as address,
        at_address(address),
        pytest.raises(LocationError, match=r"could not be uploaded.*the run is in") as caught,
    ):
        upload(tmp_path, Url("s3://hall/axis"))
    assert caught.value.directory == str(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == list(files)


def record(url: Url, before_sending: Callable[[], object]) -> None:
    with Upload(url) as there:
        write_whole(there.path / "run.json", b"{}")
        before_sending()
        there.send()


@pytest.mark.usefixtures("s3")
def test_of_two_runs_for_one_url_the_later_one_remains_here(temporary: Path) -> None:
    url = Url("s3://hall/race/axis")
    with pytest.raises(LocationError, match=r"exists already.*the run is in") as caught:
        record(url, lambda: write_whole(url / "run.json", b"earlier"))
    assert read_bytes(url / "run.json") == b"earlier"
    assert [path / "axis" for path in temporary.iterdir()] == [Path(caught.value.directory)]


@pytest.mark.usefixtures("s3")
def test_a_run_that_fails_leaves_nothing(temporary: Path) -> None:
    def fails() -> None:
        raise RuntimeError

    with pytest.raises(RuntimeError):
        record(Url("s3://hall/failed"), fails)
    assert not list(temporary.iterdir())
    assert not find("s3://hall/failed*")


def test_an_unknown_scheme_is_named() -> None:
    with pytest.raises(LocationError, match=r"nosuch.*check the part before ://") as caught:
        find("nosuch://a/*.csv")
    assert caught.value.code == "location.scheme-unknown"


@pytest.mark.parametrize("package", ["fsspec", "s3fs"])
def test_a_missing_package_is_installed_by_the_extra(package: str) -> None:
    program = (
        f"import sys; sys.modules[{package!r}] = None\n"
        "from livebode.core import ExtraError; from livebode.locations import read_bytes\n"
        "try: read_bytes('s3://hall/a.csv')\n"
        "except ExtraError as error: print(error.package, error)"
    )
    done = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    assert done.stdout.startswith(f"{package} s3://hall/a.csv needs ")
    assert "remote" in done.stdout


def test_a_secret_is_not_in_the_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_PROXY", "*")
    with answering(http("404 Not Found")) as address:
        url = address.replace("http://", "http://user:hidden@") + "/a.csv?signature=hidden"
        with pytest.raises(LocationError) as caught, local_copy(url):
            pass
    assert "hidden" not in f"{caught.value} {caught.value.facts}"
