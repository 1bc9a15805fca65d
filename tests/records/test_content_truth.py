"""The name of a content is what `sha256sum` prints, wherever the bytes are and however many there are."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from livebode.core import RecordingError
from livebode.records import content_sha256, joined_sha256
from tests.support.errors import refused


def as_sha256sum(path: Path) -> str:
    return subprocess.run(["sha256sum", path], capture_output=True, text=True, check=True).stdout.split()[0]


@pytest.mark.parametrize("size", [0, 1, (1 << 18) - 1, 1 << 18, 3_000_001])
def test_a_file_has_the_digest_of_its_bytes_under_any_name(tmp_path: Path, size: int) -> None:
    path, other = tmp_path / "a.csv", tmp_path / "b.mat"
    path.write_bytes(os.urandom(size))
    shutil.copy(path, other)
    assert content_sha256(path) == content_sha256(other) == as_sha256sum(path)


def test_a_directory_has_one_digest_of_its_files_and_none_of_its_own_name(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    (bag / "inner").mkdir(parents=True)
    for name in ("part_0.mcap", "metadata.yaml", "inner/part_1.mcap"):
        (bag / name).write_bytes(name.encode())
    whole = content_sha256(bag)
    listed = "".join(f"{as_sha256sum(bag / n)}\n" for n in ("inner/part_1.mcap", "metadata.yaml", "part_0.mcap"))
    assert whole == hashlib.sha256(listed.encode()).hexdigest()
    assert content_sha256(bag.rename(tmp_path / "other")) == whole
    (tmp_path / "other" / "part_0.mcap").write_bytes(b"changed")
    assert content_sha256(tmp_path / "other") != whole


def test_several_recordings_have_one_digest_in_their_order() -> None:
    one, two = (hashlib.sha256(data).hexdigest() for data in (b"1", b"2"))
    assert joined_sha256([one]) == one
    assert len({joined_sha256(parts) for parts in ([one], [one, two], [two, one], [one, two, two], [one + two])}) == 5


def test_what_cannot_be_read_is_refused(tmp_path: Path) -> None:
    missing = tmp_path / "missing.csv"
    with refused(RecordingError, "not-found", path=str(missing)):
        content_sha256(missing)
    pretended = tmp_path / "file"
    pretended.write_bytes(b"")
    with refused(RecordingError, "not-readable", path=str(pretended / "inside")):
        content_sha256(pretended / "inside")
