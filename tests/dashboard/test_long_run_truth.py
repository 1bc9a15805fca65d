"""A long run is shown from its means: the same plant and times as its responses, and the newest ones in full."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from livebode.dashboard import Past
from livebode.dashboard.run_feed import RunFeed
from livebode.dashboard.state import State
from livebode.records import RunRecord, thinned
from tests.support.long_runs import PLANT, noisy_responses, record_long

RESPONSES = noisy_responses(1500, seed=5)


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A finished run of 25 min in segments of 100 s, that is long enough."""
    monkeypatch.setattr("livebode.dashboard.run_feed._LONG_BYTES", 1)
    monkeypatch.setattr("livebode.dashboard.past._READ_BYTES", 1)
    record_long(tmp_path, 100.0, RESPONSES)
    return tmp_path


def test_the_page_has_means_of_the_whole_run_and_its_newest_responses(run: Path) -> None:
    state = State("axis", 0)
    RunFeed(run).fill(state)
    whole, recent = state.overview.responses(), state.recent.all()
    assert recent is not None
    assert state.newest is not None
    assert (state.health()["responses"], state.newest.sample[0]) == (len(RESPONSES), RESPONSES.sample[-1])
    assert (state.first_s, state.last_s) == (RESPONSES.time_s[0], RESPONSES.time_s[-1])
    assert recent.sample.tolist() == RESPONSES.sample[-len(recent) :].tolist()
    assert len(whole) < len(RESPONSES) / 3
    assert (whole.first[0], whole.sample[-1]) == (RESPONSES.first[0], RESPONSES.sample[-1])
    past = Past.of(state).between(300.0, 900.0, 60)
    assert 50 <= len(past) <= 60
    assert np.abs(past.value - PLANT).max() < 0.5
    assert past.sigma.max() < RESPONSES.sigma.mean()


def test_means_of_a_minute_are_those_of_all_responses_in_it(run: Path) -> None:
    found = thinned(RunRecord.open(run), 60.0)
    assert found is not None
    for row in (0, 7, len(found) - 1):
        within = RESPONSES[np.flatnonzero(RESPONSES.time_s // 60 == row)]
        np.testing.assert_allclose(found.value[row], within.value.mean(axis=0), rtol=1e-9)
        assert (found.first[row], found.sample[row]) == (within.first[0], within.sample[-1])


def test_responses_that_are_not_in_a_segment_yet_are_in_the_means(tmp_path: Path) -> None:
    record_long(tmp_path, 100.0, RESPONSES[:1000], finished=False)
    (last,) = [path.name for path in (tmp_path / "open").iterdir()]
    assert last
    found = thinned(RunRecord.open(tmp_path), 10.0)
    assert found is not None
    assert found.sample[-1] == RESPONSES.sample[999]
