"""The page that follows a batch of samples through the code names what exists, in the order in which it is called."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from pkgutil import resolve_name
from typing import get_args

import pytest

from livebode.runtime import RunLoop, documents

PAGE = (Path(__file__).parents[2] / "docs" / "explanation" / "code-flow.md").read_text("utf-8")
NAMES = sorted(set(re.findall(r"`(livebode(?:\.\w+)+)`", PAGE)))


@pytest.mark.parametrize("name", NAMES)
def test_a_name_on_the_page_exists(name: str) -> None:
    resolve_name(name)


def test_the_loop_calls_its_steps_in_the_order_of_the_page() -> None:
    call = r"self\.(?:_recorder\.|_stream\.)?(\w+)\("
    assert re.findall(call, inspect.getsource(RunLoop._steps))[::2] == ["_numbered", "pieces", "_wait_for_record"]
    assert re.findall(call, inspect.getsource(RunLoop._process)) == [
        "write_samples", "_publish_noticed", "publish_all", "_count", "_joined", "_estimate", "_report_events",
        "announce", "_publish_findings", "commit",
    ]  # fmt: skip
    rules = r"self\.estimate\.(\w+)\("
    assert re.findall(rules, inspect.getsource(RunLoop._process)) == ["monitor", "process", "check"]
    assert re.findall(rules, inspect.getsource(RunLoop._estimate)) == ["valid", "documents"]
    order = (
        "Number",
        "Split",
        "Ready",
        "Monitor",
        "Estimate",
        "Record and publish",
        "Events",
        "Check signals",
        "Commit",
    )
    places = [PAGE.index(f"\n{word}\n: ") for word in order]
    assert places == sorted(places)


def test_every_document_is_on_the_page() -> None:
    kinds = {getattr(kind, "__forward_arg__", None) or kind.__name__ for kind in get_args(documents.Document)}
    rows = re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE)
    assert set(rows) == kinds
