"""A run is replaced with every file that the page of its directory names."""

from __future__ import annotations

import re
from pathlib import Path

from livebode.records.removal import foreign

PAGE = Path(__file__).parents[2] / "docs/reference/run-directory.md"


def test_every_file_that_the_page_names_is_removed_with_the_run(tmp_path: Path) -> None:
    """Folders are tested with the runs that write them."""
    table = re.search(r"\| file \|.*?\n\n", PAGE.read_text("utf-8"), re.S)
    assert table is not None
    names = set(re.findall(r"`([a-z-]+\.[a-z]+)`", table[0]))
    assert {"run.json", "tune.json", "loop-check.json", "filters.st", "friction.svg"} <= names
    for name in names:
        (tmp_path / name).touch()
    (tmp_path / "thesis.tex").touch()
    assert foreign(tmp_path) == ["thesis.tex"]
