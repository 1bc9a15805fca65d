"""A small campaign of faults against a fleet of processes: nothing is missing, doubled or different."""

from __future__ import annotations

import json
import random
from dataclasses import asdict
from pathlib import Path

import pytest

from studies.fleet_faults import ROUND, Campaign, RoundResult, campaign, fault_round


def test_a_worker_and_a_log_that_are_killed_at_once_among_reordered_messages_cost_no_response() -> None:
    found = fault_round(1, [("reordering", "kill", "broker")], 2, random.Random(2))
    assert found.exact, found
    assert (found.faults, found.overlapping) == (3, 2)
    assert found.meetings == {"kill during reordering": 1, "broker during kill": 1, "broker during reordering": 1}
    assert found.takeovers > 0
    assert found.check["responses"] > 0
    assert found.lost == 0


def _recorded(path: Path, rounds: list[RoundResult]) -> None:
    asked = {"faults": ROUND, "axes": 2, "kinds": ["kill"], "seed": 1, "alone": False}
    about = {"asked": asked, "summary": Campaign(rounds).summary(), "rounds": [asdict(one) for one in rounds]}
    path.write_text(json.dumps(about))


def test_recorded_rounds_are_not_repeated_and_count(tmp_path: Path) -> None:
    record = tmp_path / "faults.json"
    whole = {"responses": 900, "missing": 0, "doubled": 0, "different": 0, "unexpected": 0, "other_recipe": 0}
    _recorded(record, [RoundResult(1, 2, {"kill": ROUND}, check=whole, takeovers=80)])
    (found,) = campaign(ROUND, axes=2, kinds=["kill"], seed=1, at_once=1, alone=False, record=record)
    assert found.exact
    assert (found.faults, found.sum("takeovers"), found.total.responses) == (ROUND, 80, 900)
    with pytest.raises(SystemExit, match="other options"):
        next(campaign(ROUND, axes=2, kinds=["kill"], seed=2, at_once=1, alone=False, record=record))


@pytest.mark.parametrize(
    "wrong",
    [
        {"check": {"doubled": 1}},
        {"dropped": 5},
        {"dropped": 5, "lost": 5},  # where no fault fills a buffer
        {"failure": "a partition is behind"},
    ],
)
def test_a_doubled_response_an_uncounted_loss_or_a_round_without_an_end_is_not_exact(wrong: dict[str, object]) -> None:
    good = RoundResult(1, 2, {"kill": 2})
    assert Campaign([good]).exact
    assert not Campaign([good, RoundResult(**asdict(good) | wrong)]).exact
