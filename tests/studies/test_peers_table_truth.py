"""The judge of the peers: when they are asked, what counts as an error, and what the tables say."""

from __future__ import annotations

import numpy as np
import pytest

from studies.peers import table
from studies.peers.__main__ import BEGIN, END, PAGE
from studies.peers.estimates import Estimates
from studies.peers.peers import FILTER, PEERS, TEXTBOOK, TUNED
from studies.peers.recording import CASES, LINES, MAIN, RATE_HZ, STROKES, Recording, record
from studies.peers.score import Score, score


@pytest.fixture(scope="module")
def recording() -> Recording:
    return record(0)


def perfect(recording: Recording, delay: float, stiffness: float = 1.0) -> Estimates:
    moment = recording.judged - delay
    parameters = recording.true_parameters(moment) * [1, 1, stiffness, 1]
    return Estimates(recording.judged, delay, recording.true_response(moment), parameters)


def test_all_are_asked_at_full_speed_in_the_second_cycle(recording: Recording) -> None:
    cycle = len(STROKES.cycle(RATE_HZ)[0])
    assert recording.judged.min() >= cycle
    assert np.allclose(window_way_m(recording), 0.038, atol=0.004)
    assert {*np.sign(window_way_m(record(0, CASES[1]))).tolist()} == {-1.0, 1.0}


def window_way_m(recording: Recording) -> np.ndarray:
    """How far the cart went in each last window."""
    position = recording.truth.position_m
    return position[recording.judged] - position[recording.judged - LINES.window]


def test_a_perfect_answer_has_no_error_at_its_own_moment(recording: Recording) -> None:
    found = score([recording], [perfect(recording, 100.0)])
    assert found == Score(*(pytest.approx(0.0, abs=1e-9) for _ in range(3)))


def test_a_stiffness_one_percent_off_is_one_percent_off(recording: Recording) -> None:
    assert score([recording], [perfect(recording, 0.0, 1.01)]).stiffness_percent == pytest.approx(1.0)


def test_a_late_answer_that_calls_itself_new_is_wrong(recording: Recording) -> None:
    late = perfect(recording, 400.0)
    new = Estimates(late.sample, 0.0, late.value, late.parameters)
    assert score([recording], [new]).stiffness_percent > 3


def test_three_masses_are_judged_by_their_response_alone() -> None:
    recording = record(0, CASES[-1])
    few = Recording(recording.case, recording.block, recording.truth, recording.judged[::100])
    exact = few.true_response(few.judged)
    found = score([few], [Estimates(few.judged, 0.0, 1.1 * exact)])
    assert found.magnitude_db == pytest.approx(20 * np.log10(1.1))
    assert np.isnan(found.stiffness_percent)


def test_targets_are_judged_for_each_way_of_livebode() -> None:
    scores = {TEXTBOOK: Score(6, 60, 9), TUNED: Score(1, 1.7, 1), FILTER: Score(1, 1.0, 1)}
    text = table.targets(scores | {"livebode": Score(1, 3, 1), "livebode, better": Score(1, 1.0, 1)})
    assert text.splitlines()[2:] == [
        "| livebode | 20.00 missed | 0.57 missed | 3.00 missed |",
        "| livebode, better | 60.00 met | 1.70 missed | 1.00 met |",
    ]


def test_winners_name_the_best_on_either_side() -> None:
    scores = {"a": Score(2, 2, 2), "b": Score(1, 3, 3), "livebode": Score(4, 4, 4)}
    lines = table.winners({MAIN: scores}).splitlines()
    assert [line.split(" | ")[1] for line in lines[2:]] == ["b", "a", "a"]


def test_the_names_that_targets_ask_for_are_peers() -> None:
    names = [peer.name for peer in PEERS]
    assert {TEXTBOOK, TUNED, FILTER} < {*names}
    assert len({*names}) == len(names)


def test_the_page_shows_the_peers_that_there_are() -> None:
    text = PAGE.read_text()
    shown = text[text.index(BEGIN) : text.index(END)]
    assert [peer.name for peer in PEERS if shown.count(f"| {peer.name} |") < len(CASES) + 1] == []
    assert all(column in shown for column in table.COLUMNS)
