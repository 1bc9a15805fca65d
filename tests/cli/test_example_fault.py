"""`livebode example`: the same files on each call, and nothing of a user's is overwritten."""

from __future__ import annotations

import json
from pathlib import Path

from livebode.plugins import named
from tests.support.command import livebode


def test_without_a_name_it_lists_every_example_with_its_files() -> None:
    listed = livebode("example").out
    for name, example in named("examples").items():
        assert all(text in listed for text in (name, example.about, *example.files))
    assert set(json.loads(livebode("example", "--json").out)) == set(named("examples"))


def test_a_second_call_leaves_equal_files_and_refuses_to_replace_an_edited_one(tmp_path: Path) -> None:
    out = tmp_path / "example"
    assert livebode("example", "chirp", "--out", out).code == 0
    first = {path.name: path.read_bytes() for path in out.iterdir()}
    again = livebode("example", "chirp", "--out", out)
    assert (again.code, {path.name: path.read_bytes() for path in out.iterdir()}) == (0, first)
    (out / "chirp.toml").write_text("# mine\n")
    refused = livebode("example", "chirp", "--out", out)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert (out / "chirp.toml").read_text() == "# mine\n"
    assert livebode("example", "chirp", "--out", out, "--force").code == 0
    assert (out / "chirp.toml").read_bytes() == first["chirp.toml"]


def test_a_directory_that_is_not_the_lake_of_the_example_remains_also_with_force(tmp_path: Path) -> None:
    (tmp_path / "hall").mkdir()
    (tmp_path / "hall" / "thesis.tex").write_text("years of work")
    done = livebode("example", "hall", "--out", tmp_path, "--force")
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert "not a lake" in done.err
    assert (tmp_path / "hall" / "thesis.tex").read_text() == "years of work"


def test_an_unknown_name_and_a_file_in_place_of_the_directory_are_one_sentence_each(tmp_path: Path) -> None:
    refused = livebode("example", "sweep", "--out", tmp_path)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert "choose standstill, moving" in refused.err
    (tmp_path / "file").write_text("")
    refused = livebode("example", "chirp", "--out", tmp_path / "file")
    assert (refused.code, refused.err.count("\n")) == (2, 1)
