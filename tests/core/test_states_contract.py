"""Everything with a state keeps one contract: exact, checked, versioned, and unchanged by what it refuses."""

from __future__ import annotations

from functools import cache

import pytest

from tests.support.stateful import check_stateful, every_class
from tests.support.stateful_cases import CASES


@cache
def checked(name: str) -> set[type]:
    return check_stateful(CASES[name]())


@pytest.mark.parametrize("name", CASES)
def test_a_restored_stage_continues_and_refuses_wrong_states(name: str) -> None:
    assert checked(name)


def test_every_class_with_a_state_is_checked() -> None:
    assert every_class() == set().union(*(checked(name) for name in CASES))
