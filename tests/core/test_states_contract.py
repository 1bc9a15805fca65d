"""Everything with a state keeps one contract: exact, checked, versioned, and unchanged by what it refuses."""

from __future__ import annotations

import re
import sys
from functools import cache
from pathlib import Path

import pytest

from livebode.core import Stage
from livebode.kernel import SlidingDFT
from tests.support.stateful import check_stateful, every_class
from tests.support.stateful_cases import CASES

ROOT = Path(__file__).parents[2]


@cache
def checked(name: str) -> set[type]:
    return check_stateful(CASES[name]())


@pytest.mark.parametrize("name", CASES)
def test_a_restored_stage_continues_and_refuses_wrong_states(name: str) -> None:
    assert checked(name)


def test_every_class_with_a_state_is_checked() -> None:
    assert every_class() == set().union(*(checked(name) for name in CASES))


def test_the_page_of_formats_lists_every_stage_with_its_version() -> None:
    page = (ROOT / "docs/reference/formats.md").read_text("utf-8")
    listed = dict(re.findall(r"^\| `([a-z-]+)` \| (\d+) \| [^|]+ \|$", page[page.index("### Stages") :], re.M))
    stages = [stage_of(one) for one in every_class() if one is not SlidingDFT]
    assert listed == {stage.name: str(stage.version) for stage in stages}
    assert len({stage.name for stage in stages}) == len(stages)


def stage_of(one: type) -> Stage:
    found = getattr(one, "_stage", None) or vars(sys.modules[one.__module__])["_STAGE"]
    assert isinstance(found, Stage)
    return found
