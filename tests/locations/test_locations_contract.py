"""Find, copy, read and write at paths, in memory and on a real S3 server: the same everywhere."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from livebode.core import LocationError
from livebode.locations import (
    Location,
    Url,
    find,
    local_copy,
    location,
    read_bytes,
    upload,
    write_whole,
)
from tests.support.object_storage import BUCKET, object_storage


@pytest.fixture(scope="module")
def s3() -> Iterator[str]:
    with object_storage() as address:
        yield address


@pytest.fixture(params=["path", "memory", "s3"])
def root(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """A place with nothing below it."""
    name = f"{tmp_path.parent.name}-{tmp_path.name}"
    if request.param == "s3":
        request.getfixturevalue("s3")
    places = {"path": f"{tmp_path}", "memory": f"memory://{name}"}
    return places.get(request.param, f"s3://{BUCKET}/{name}")


def test_what_is_written_is_found_in_order_and_read(root: str) -> None:
    for name in ("b/2.csv", "a.csv", "b/c/1.csv", "b/3.txt"):
        write_whole(f"{root}/{name}", name.encode())
    found = find(f"{root}/**/*.csv")
    below = str(location(root)).rstrip("/")
    assert [str(one.url).removeprefix(below) for one in found] == ["/a.csv", "/b/2.csv", "/b/c/1.csv"]
    assert [one.size_bytes for one in found] == [5, 7, 9]
    assert [read_bytes(one.url) for one in found] == [b"a.csv", b"b/2.csv", b"b/c/1.csv"]
    assert [str(one.url).removeprefix(below) for one in find(f"{root}/b")] == ["/b/2.csv", "/b/3.txt", "/b/c/1.csv"]
    assert find(f"{root}/b/3.txt")[0].size_bytes == 7
    assert find(f"{root}/*.nothing") == []


def test_a_version_changes_with_the_content_only(root: str) -> None:
    write_whole(f"{root}/a.csv", b"one")
    (first,), (again,) = find(f"{root}/*.csv"), find(f"{root}/*.csv")
    write_whole(f"{root}/a.csv", b"three")
    (second,) = find(f"{root}/*.csv")
    assert first == again
    assert second.version != first.version


def test_a_copy_has_name_and_content_and_is_removed(root: str) -> None:
    write_whole(f"{root}/site/a.csv", b"t,y\n0,1\n")
    with local_copy(f"{root}/site/a.csv") as path:
        assert (path.name, path.read_bytes()) == ("a.csv", b"t,y\n0,1\n")
    assert path.exists() == isinstance(location(root), Path)


def test_a_new_file_is_written_once(root: str) -> None:
    write_whole(f"{root}/lake/00.json", b"one", new=True)
    with pytest.raises(LocationError, match="exists already") as caught:
        write_whole(f"{root}/lake/00.json", b"two", new=True)
    assert caught.value.code == "location.exists"
    assert read_bytes(f"{root}/lake/00.json") == b"one"
    assert [str(one.url)[-7:] for one in find(f"{root}/lake")] == ["00.json"]


def test_what_is_missing_is_not_found(root: str) -> None:
    with pytest.raises(LocationError) as caught:
        read_bytes(f"{root}/none.csv")
    assert caught.value.code == "location.not-found"
    assert "none.csv" in str(caught.value)


def a_run(folder: Path) -> Path:
    (folder / "responses").mkdir(parents=True)
    for name in ("run.json", "events.jsonl", "responses/000001.parquet"):
        (folder / name).write_text(name)
    return folder


def test_a_run_arrives_as_it_was(root: str, tmp_path: Path) -> None:
    place = location(f"{root}/runs/axis")
    if isinstance(place, Path):
        return  # a path is itself
    upload(a_run(tmp_path / "run"), place)
    with local_copy(place) as copy:
        files = {path.relative_to(copy).as_posix(): path.read_text() for path in copy.rglob("*") if path.is_file()}
        assert copy.name == "axis"
    assert files == {name: name for name in ("run.json", "events.jsonl", "responses/000001.parquet")}
    assert not copy.exists()


@pytest.mark.usefixtures("s3")
def test_a_second_run_does_not_replace_the_first(tmp_path: Path) -> None:
    url = Url(f"s3://{BUCKET}/twice/axis")
    upload(a_run(tmp_path / "run"), url)
    with pytest.raises(LocationError, match=r"exists already.*the run is in '") as caught:
        upload(tmp_path / "run", url)
    assert caught.value.reason == "location.exists"


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        (r"C:\logs\a.csv", Path), ("C://logs/a.csv", Path), ("logs/a.csv", Path), ("~/a.csv", Path), (Path("a"), Path),
        ("a::b", Path), ("s3:/b/a.csv", Path), ("s3://b/a.csv", Url), ("S3://b/a.csv", Url), ("gs+x://b", Url),
    ],
)  # fmt: skip
def test_only_a_scheme_of_two_letters_and_two_slashes_is_a_url(text: str, kind: type[Location]) -> None:
    assert isinstance(location(text), kind)
    assert str(location(text)) == str(text) if kind is Url else str(Path(text))


def test_a_file_url_is_a_path(tmp_path: Path) -> None:
    assert location((tmp_path / "ä b.csv").as_uri()) == tmp_path / "ä b.csv"


@pytest.mark.parametrize(
    "address",
    ["ftp://user:hidden@host/a.csv", "https://host/a.csv?signature=hidden", "https://hidden@host/a.csv?x=1&hidden=2"],
)
def test_a_secret_in_a_url_is_not_shown(address: str) -> None:
    url = Url(address)
    assert "hidden" not in f"{url} {url!r} {url.name} {[url]}"
    assert (url.name, url.stem, url.suffix) == ("a.csv", "a", ".csv")


def test_a_path_imports_nothing_of_fsspec(tmp_path: Path) -> None:
    program = (
        "import sys; from livebode.locations import *; p = sys.argv[1]; write_whole(p + '/a', b'1', new=True)\n"
        "with local_copy(p + '/a') as a: find(p); read_bytes(a)\n"
        "sys.exit('fsspec' in sys.modules or 'pyarrow' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program, str(tmp_path)], check=True)
