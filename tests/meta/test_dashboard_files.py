"""The page's files: what is not ours is as it was published, what is ours is small and fetches nothing elsewhere."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

HERE = Path(__file__).parents[2] / "src/livebode/dashboard"


def test_uplot_is_as_it_was_published() -> None:
    words = (HERE / "_vendor/uplot/README.md").read_text()
    sums = dict(re.findall(r"^ {4}([0-9a-f]{64})  (\S+)$", words, re.M))
    assert set(sums.values()) == {"uPlot.esm.js", "uPlot.min.css"}
    for wanted, name in sums.items():
        assert hashlib.sha256((HERE / "_vendor/uplot" / name).read_bytes()).hexdigest() == wanted
    assert "MIT" in (HERE / "_vendor/uplot/LICENSE").read_text()
    assert re.search(r"uPlot 1\.\d+\.\d+", words)


def test_ours_are_small_and_import_only_what_is_here() -> None:
    for file in (HERE / "static").glob("*.js"):
        text = file.read_text(encoding="utf-8")
        assert text.startswith("//"), file.name
        assert text.count("\n") < 300, file.name
        assert max(map(len, text.splitlines())) <= 200, file.name
        for name in re.findall(r'from "([^"]+)"', text):
            where = (
                HERE / "_vendor" / name.removeprefix("/static/") if name.startswith("/static/") else file.parent / name
            )
            assert where.is_file(), (file.name, name)
        assert not re.search(r"https?://(?!www\.w3\.org)", text), file.name
