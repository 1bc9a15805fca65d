"""The page's files: what is not ours is as it was published, what is ours has types and fetches nothing elsewhere."""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
HERE = ROOT / "src/livebode/dashboard"
STATIC = (HERE / "static", *ROOT.glob("wings/*/src/**/static"))
"""Directories whose files the server has at one address: those of the dashboard, and those of wings."""


def test_uplot_is_as_it_was_published() -> None:
    words = (HERE / "_vendor/uplot/README.md").read_text()
    sums = dict(re.findall(r"^ {4}([0-9a-f]{64})  (\S+)$", words, re.M))
    assert set(sums.values()) == {"uPlot.esm.js", "uPlot.min.css"}
    for expected, name in sums.items():
        assert hashlib.sha256((HERE / "_vendor/uplot" / name).read_bytes()).hexdigest() == expected
    assert "MIT" in (HERE / "_vendor/uplot/LICENSE").read_text()
    assert re.search(r"uPlot 1\.\d+\.\d+", words)


def test_scripts_of_the_page_are_type_checked_and_import_only_local_files() -> None:
    for file in (file for folder in STATIC for file in folder.glob("*.js")):
        text = file.read_text(encoding="utf-8")
        assert text.startswith("// @ts-check\n"), file.name
        assert not re.search(r"@ts-(ignore|nocheck)|[{<:|]\s*any\b", text), file.name
        for name in re.findall(r'^import [^;"]*"([^"]+)"', text, re.M):
            vendored = name.startswith("/static/")
            places = [HERE / "_vendor" / name.removeprefix("/static/")] if vendored else [one / name for one in STATIC]
            assert any(place.is_file() for place in places), (file.name, name)
        assert not re.search(r"https?://(?!www\.w3\.org)", text), file.name


def test_the_tools_of_the_page_are_pinned_by_hash_and_without_addresses() -> None:
    lock = json.loads((ROOT / "package-lock.json").read_text())
    tools = {name: facts for name, facts in lock["packages"].items() if name}
    assert {f"node_modules/{name}" for name in ("@biomejs/biome", "esbuild", "typescript")} <= tools.keys()
    assert all(facts["integrity"].startswith("sha512-") and "resolved" not in facts for facts in tools.values())
    shown = re.search(r"uPlot ([\d.]+)", (HERE / "_vendor/uplot/README.md").read_text())
    assert shown is not None
    assert tools["node_modules/uplot"]["version"] == shown[1]  # its types are those of the uPlot that is shipped
