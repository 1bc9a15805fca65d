"""Names from a browser: whatever they are, no path outside of the directory is opened, and no file replaced."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from livebode.core import ServerError
from livebode_start.workspace import NAME_BYTES_MAX, Workspace, harmless_name
from tests.support.errors import refused
from tests.support.many_runs import ask
from tests.support.start_pages import send, start_page

SECRET = "t,torque,speed\n" + "".join(f"{k / 1000},{k % 7},{k % 5}\n" for k in range(4000))
PIECES = st.sampled_from(
    [
        "..", ".", "/", "\\", "\0", "C:", "//host/share", "~", "secret.csv", "outside", "link.csv", "dir", "con",
        "aux.csv", "run.json", "%2e%2e", "%00", "\u202e", " ", "a" * 300, "ä", "file://", "inside.csv", ":stream", "\n",
    ]
)  # fmt: skip
NAMES = st.lists(st.one_of(PIECES, st.text(max_size=4)), max_size=6).map("".join)


@pytest.fixture(scope="module")
def places(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str]]:
    """A directory with a recording, and what must not be opened: beside it, below it and behind links."""
    outside = tmp_path_factory.mktemp("outside")
    folder = outside / "runs"
    (folder / "dir").mkdir(parents=True)
    for path in (outside / "secret.csv", folder / "dir" / "secret.csv", folder / ".hidden.csv"):
        path.write_text(SECRET)
    (folder / "inside.csv").write_text(SECRET.replace("torque", "u"))
    (folder / "link.csv").symlink_to(outside / "secret.csv")
    (folder / "outside").symlink_to(outside, target_is_directory=True)
    os.mkfifo(folder / "pipe.csv")
    with start_page(folder) as url:
        yield folder, url


@given(name=NAMES)
@example("../secret.csv")
@example("link.csv")
@example(".hidden.csv")
@example("pipe.csv")
@example("outside/secret.csv")
@example("C:\\Windows\\win.ini")
@example("/etc/passwd")
@example("inside.csv\0.png")
def test_only_plain_files_of_the_directory_are_found(places: tuple[Path, str], name: str) -> None:
    folder, _ = places
    if name == "inside.csv":
        assert Workspace(folder).path(name) == folder / name
    else:
        with refused(ServerError, "file-unknown"):
            Workspace(folder).path(name)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(name=NAMES)
@example("../secret.csv")
@example("link.csv")
@example("dir/secret.csv")
def test_no_request_answers_with_a_file_outside(places: tuple[Path, str], name: str) -> None:
    folder, url = places
    asked = quote(name.encode(errors="replace"), safe="")[:900]
    for path in (f"/api/recording?recording={asked}", f"/api/preview?recording={asked}&channel=torque"):
        status, _, answer = ask(url, path)
        assert "torque" not in str(answer) or status in (400, 414)
    for order in ("configuration", "measure"):
        choices = {"recording": name, "signals": {"input": "torque", "output": "speed"}}
        if name != "inside.csv":
            assert ask(url, f"/api/{order}", choices)[0] == 400
    assert not list(folder.glob("*.toml"))


@given(name=NAMES)
@example("a" * 300 + ".json")
@example(".json")
@example("a" * 95 + ".json" + "b" * 50)
def test_a_harmless_name_is_one_of_every_system(name: str) -> None:
    found = harmless_name(name)
    assert found == os.path.basename(found) == harmless_name(found)
    assert found not in ("", ".", "..")
    assert not set(found) & set('<>:"/\\|?*\0\n')
    assert not found.startswith((".", " "))
    assert not found.endswith((".", " "))
    assert not found.lower().endswith((".toml", ".json"))
    assert len(found.encode()) <= NAME_BYTES_MAX + 60


@settings(max_examples=25, deadline=None)
@given(name=NAMES)
@example("../../secret.csv")
@example("link.csv")
@example("dir")
@example("con")
def test_an_upload_of_any_name_is_a_new_file_of_the_directory(places: tuple[Path, str], name: str) -> None:
    folder, url = places
    before = {path: path.lstat().st_mtime_ns for path in folder.parent.rglob("*") if path.is_file()}
    status, answer = send(
        url, f"/api/upload?name={quote(name.encode(errors='replace'), safe='')[:900]}", SECRET.encode()
    )
    assert status == 200, answer
    stored = folder / answer["recording"]
    after = {path: path.lstat().st_mtime_ns for path in folder.parent.rglob("*") if path.is_file()}
    assert stored.parent == folder
    assert not stored.is_symlink()
    assert after.keys() - before.keys() == {stored}
    assert all(after[path] == before[path] for path in before)
    stored.unlink()
