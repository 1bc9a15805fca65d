"""Only plain files are removed, by plain names, in a directory that is not a link."""

from __future__ import annotations

import os
import re
import socket
from pathlib import Path

import pytest

from livebode.core import remove_created, remove_files, whole_file


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A directory with a file, and one of each kind that is not a file."""
    for name in ("place/folder", "outside"):
        (tmp_path / name).mkdir(parents=True)
    place = tmp_path / "place"
    for path in (place / "file", place / "folder" / "inner", tmp_path / "outside" / "victim", tmp_path / "victim"):
        path.write_text("years of work")
    (place / "link").symlink_to(tmp_path / "victim")
    (place / "link to a folder").symlink_to(tmp_path / "outside")
    os.mkfifo(place / "pipe")
    before = Path.cwd()
    os.chdir(place)
    with socket.socket(socket.AF_UNIX) as one:
        one.bind("socket")
    os.chdir(before)
    return place


def tree(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*"))


@pytest.mark.parametrize(
    "name",
    [
        "link", "link to a folder", "pipe", "socket", "folder", "", ".", "..", "../victim", "folder/inner",
        "/etc/hostname", "link to a folder/victim", "./file",
    ],
)  # fmt: skip
def test_what_is_not_a_plain_file_of_the_directory_is_refused(place: Path, name: str) -> None:
    before = tree(place.parent)
    with pytest.raises(OSError, match="so it is not removed"):
        remove_files(place, [name])
    assert tree(place.parent) == before


def test_a_directory_that_is_a_link_is_refused(place: Path) -> None:
    with pytest.raises(OSError, match="Not a directory"):
        remove_files(place / "link to a folder", ["victim"])
    assert (place.parent / "outside" / "victim").exists()


def test_files_are_removed_by_their_names_and_missing_ones_ignored(place: Path) -> None:
    os.link(place.parent / "victim", place / "another name")
    assert remove_files(place, ["file", "absent", "another name"]) == 2
    assert not (place / "file").exists()
    assert (place.parent / "victim").read_text() == "years of work"


def test_what_this_process_created_is_removed_without_following_links(place: Path) -> None:
    remove_created(place)
    assert tree(place.parent) == [place.parent / name for name in ("outside", "outside/victim", "victim")]


@pytest.mark.parametrize("name", ["pipe", "socket", "folder"])
def test_a_file_is_not_written_in_the_place_of_something_else(place: Path, name: str) -> None:
    before = tree(place.parent)
    with pytest.raises(OSError, match=re.escape("it is a directory, a pipe, a socket or a device")):  # noqa: SIM117
        with whole_file(place / name) as partial:
            partial.write_text("new")
    assert tree(place.parent) == before
