"""Processes that record each kind of live source are killed at random moments; `make crash` kills many more."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from tests.support.killed_live import check_exact, kill_often
from tests.support.live_feeds import FEEDS, WHOLE

KILLS = int(os.environ.get("LIVEBODE_CRASH_KILLS_EACH", "1"))
OF_A_RUN = 100
"""Kills of one run: continuing reads what is recorded, so that a thousand of one would take hours."""


# The PLC of the tests does not expect that who asks it is killed.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("kind", FEEDS)
def test_a_kill_costs_at_most_a_second_doubles_nothing_and_every_loss_is_exact(kind: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(sorted(FEEDS).index(kind))
    longest = 0
    for first in range(0, KILLS, OF_A_RUN):
        folder = tmp_path / str(first)
        folder.mkdir()
        with FEEDS[kind](folder) as feed:
            costs = list(kill_often(feed, folder / "run", min(OF_A_RUN, KILLS - first), rng))
        lost = check_exact(folder / "run", feed.number, whole=kind in WHOLE, exact=feed.exact)
        feed.check(folder / "run")
        longest = max(longest, lost if feed.keeps else max(costs, default=0))
    cost = "not known" if feed.number == "sample" else f"{longest / feed.rate_hz:.2f} s"
    print(f"{kind}: {KILLS} kills; the longest cost {cost}; nothing twice, each loss exact")
    assert longest <= feed.most_s * feed.rate_hz
