"""A live run names swapped channels, a transient at its start and slips of the excitation, and goes on all the same."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from livebode.analysis import averaged
from livebode.core import Block, Channel, Event, Lines, Stage, decode
from livebode.estimation import Settings
from livebode.excitation import multisine
from livebode.records import RUN, RunRecord, last_commit
from livebode.records.segments.journal import Commit
from livebode.records.summary_file import COPY, to_document
from livebode.runtime.live_checks import LiveChecks
from livebode.simulation import BeltAxis, Sensor, SimulatedAxis
from livebode.sources.live import Batch, encode_layout
from tests.support.live_session import LiveSession
from tests.support.peers.peer import free_port, until
from tests.support.peers.plain import TcpPeer

RATE_HZ, WINDOW = 4000.0, 400
LINES = Lines.parse("20:140:10", RATE_HZ, WINDOW)
NAMES = ("w", "u", "velocity")
SETTINGS = Settings(lines=LINES, output="velocity", input="u", excitation="w")


@pytest.fixture(scope="module")
def recorded() -> np.ndarray:
    """w, u, y of 14 s of an axis."""
    axis = BeltAxis(sensor=Sensor(noise_rad_per_s=0.1), excitation_n_m=multisine(LINES, 1.0), seconds=16.0)
    block = SimulatedAxis(axis).run()[0]
    return np.array([block[name][20 * WINDOW :] for name in NAMES])  # behind its own transient


def blocks(data: np.ndarray, size: int = 150, gaps: tuple[int, ...] = ()) -> Iterator[Block]:
    edges = sorted({*range(0, data.shape[1], size), *gaps, data.shape[1]})
    for start, stop in pairwise(edges):
        yield Block(data[:, start:stop], NAMES, RATE_HZ, start=start, gap=start in gaps)


def found(data: np.ndarray, settings: Settings = SETTINGS, gaps: tuple[int, ...] = (), **how: bool) -> list[Event]:
    checks = LiveChecks(settings, list(NAMES), **({"roles": True, "transient": True} | how))
    events: list[Event] = []
    passed = 0
    for block in blocks(data, gaps=gaps):
        events.extend(checks.take(block))
        passed += len(block)
    assert passed == data.shape[1]
    return events


def test_correct_roles_and_a_steady_start_raise_no_event(recorded: np.ndarray) -> None:
    assert found(recorded) == []


def test_swapped_channels_are_named_once_the_machine_is_excited(recorded: np.ndarray) -> None:
    swapped = Settings(lines=LINES, output="u", input="velocity", excitation="w")
    silent = 1e-9 * np.random.default_rng(1).standard_normal((3, 50_000))
    silent[0] = 0.0
    for data in (recorded, np.hstack([silent, recorded, recorded])):
        events = found(data, swapped, transient=False)
        assert [event.kind for event in events if event.kind == "roles-doubtful"] == ["roles-doubtful"]
        assert "look exchanged" in events[0].message
    assert found(recorded, swapped, roles=False, transient=False) == []


def test_a_transient_at_the_start_is_left_out(recorded: np.ndarray) -> None:
    data = recorded.copy()
    data[2, : 3 * WINDOW] += 50 * np.exp(-np.arange(3 * WINDOW) / WINDOW)
    (event,) = found(data)
    assert (event.kind, event.sample) == ("transient", 0)
    assert 3 <= event.details["periods"] <= 4  # where it ends, the level of the next period is another one
    assert found(data, transient=False) == []
    for missing in (np.nan, np.inf):
        holey = recorded.copy()
        holey[0, 7::5000] = missing
        assert found(holey) == []


def test_an_output_that_creeps_is_reported_once_with_the_remedy_of_a_live_run(recorded: np.ndarray) -> None:
    data = recorded.copy()
    data[2] += 0.5 * np.arange(data.shape[1]) / WINDOW
    (event,) = found(data)
    assert event.kind == "signal-drifts"
    assert "'velocity' drifts by 0.5 from window to window" in event.message
    assert "tracking.differenced" in event.message
    assert found(data, trends=False) == []
    differenced = Settings(lines=LINES, output="velocity", input="u", excitation="w", differenced=("velocity",))
    assert found(data, differenced) == []


def test_a_transient_is_judged_only_where_nothing_was_excited_before(recorded: np.ndarray) -> None:
    silent, burst = np.zeros((3, 36_000)), recorded[:, : 10 * WINDOW]
    late = np.hstack([silent, np.zeros_like(burst), silent, np.zeros_like(burst), np.zeros((3, 2000)), recorded])
    (event,) = found(late, roles=False)
    assert 82_000 <= event.details["samples"] <= 82_000 + WINDOW
    assert f"with the samples before them, {event.details['samples']} samples" in event.message
    bursts = late.copy()
    for at in (20_000, 60_000):  # too short to be judged
        bursts[:, at : at + burst.shape[1]] = burst
    assert found(bursts, roles=False) == []
    assert found(late, roles=False, gaps=(41_250,)) == []  # what was lost may have been excited


@pytest.mark.parametrize("missing", [-7, 1, 60])
def test_a_slip_that_sample_numbers_do_not_show_is_reported(recorded: np.ndarray, missing: int) -> None:
    at = 21_234
    slipped = np.hstack([recorded[:, :at], recorded[:, at + missing :]])
    events = [event for event in found(slipped, roles=False, transient=False) if event.kind == "phase-slip"]
    assert [event.details["missing_samples"] for event in events] == [missing]
    assert f"{'forward' if missing > 0 else 'back'} by {abs(missing)} sample" in events[0].message
    assert (
        f"samples are {'missing' if missing > 0 else 'repeated'}, or the generator was restarted" in events[0].message
    )
    assert abs(events[0].sample - at) <= WINDOW


def test_a_loss_that_is_known_is_no_slip(recorded: np.ndarray) -> None:
    """Where a sender began again, and nobody knows how many samples are missing."""
    at = 21_234
    slipped = np.hstack([recorded[:, :at], recorded[:, at + 60 :]])
    assert found(slipped, gaps=(at,), roles=False, transient=False) == []


SEARCHED, AT = 32 * WINDOW, 90_000


def slips_behind(lost: list[tuple[int, int]], x: np.ndarray) -> list[tuple[int, int]]:
    """The slips found in these samples without the lost ones."""
    checks = LiveChecks(SETTINGS, list(NAMES), roles=False, transient=False)
    came = [
        replace(block, gap=any(block.start == stop for _, stop in lost))
        for block in blocks(x, WINDOW, gaps=tuple(edge for loss in lost for edge in loss))
        if not any(start <= block.start < stop for start, stop in lost)
    ]
    events = [event for block in came for event in checks.take(block)]
    return [(event.sample, event.details["missing_samples"]) for event in events]


@pytest.mark.parametrize(
    "lost", [[(SEARCHED, SEARCHED + 300)], [(40_000, 40_117 + 66 * WINDOW)], [(SEARCHED, 14_000), (20_000, 70_000)]]
)
def test_a_known_loss_wherever_it_is_is_no_slip_and_shifts_none(
    recorded: np.ndarray, lost: list[tuple[int, int]]
) -> None:
    """Right behind what was searched, and longer than what is searched at a time."""
    w = np.hstack([recorded, recorded])  # of whole periods
    ((sample, missing),) = slips_behind(lost, np.delete(w, slice(AT, AT + 7), axis=1))
    assert missing == 7
    assert abs(sample - AT) <= WINDOW


def test_an_unknown_loss_behind_what_was_searched_is_no_slip(recorded: np.ndarray) -> None:
    assert slips_behind([(SEARCHED, SEARCHED)], np.delete(recorded, slice(SEARCHED, SEARCHED + 60), axis=1)) == []


class Machine(TcpPeer):
    layout = encode_layout(tuple(map(Channel, NAMES)), RATE_HZ, epoch=3)


EXCHANGED: dict[str, Any] = {
    "signals": {"excitation": "w", "input": "velocity", "output": "u"},
    "tracking": {},
    "lines": {"frequencies": "20:140:10", "window": WINDOW},
}


def send(peer: TcpPeer, data: np.ndarray, first: int = 0, stop: int | None = None) -> None:
    peer.wait_ready()
    for at in range(first, stop or data.shape[1], 500):
        peer.send(Batch(at, data[:, at : at + 500].copy(), tuple(map(Channel, NAMES)), RATE_HZ, 3))


def test_a_run_that_is_continued_before_it_was_judged_is_judged_then(tmp_path: Path, recorded: np.ndarray) -> None:
    class Again(Machine):
        port = free_port()

    def committed() -> Commit | None:
        return last_commit(tmp_path / "run") if (tmp_path / "run").exists() else None

    for first, stop, judged in ((0, 8000, False), (8000, recorded.shape[1], True)):
        with Again(tmp_path) as peer, LiveSession(tmp_path, peer, **EXCHANGED) as session:
            send(peer, recorded, first, stop)
            until(lambda stop=stop: (now := committed()) and now.sample >= stop, "all to be recorded")
        kinds = [event.kind for event in RunRecord.open(session.run).events()]
        assert (kinds.count("roles-doubtful"), kinds.count("transient")) == (judged, 0)
        now = committed()
        assert now is not None
        state = decode(Stage("run-counts", 1), now.states["counts"])
        assert state["judged"] is judged  # and not again when it is continued


def test_a_live_run_records_shows_and_leaves_out_what_it_found(tmp_path: Path, recorded: np.ndarray) -> None:
    data = recorded.copy()
    data[1:, : 3 * WINDOW] *= 30.0
    with Machine(tmp_path) as peer:
        with LiveSession(tmp_path, peer, **EXCHANGED) as session:
            send(peer, data, 0, data.shape[1] - 500)
            until(lambda: {"roles-doubtful", "transient"} <= {e.kind for e in session.events()}, "both to be recorded")
        shown = {event.kind for event in session.events() if event.message in session.shown}
        assert {"roles-doubtful", "transient"} <= shown
        forget_what_was_found(session.run)
        peer.hang_up()
        with LiveSession(tmp_path, peer, **EXCHANGED) as session:
            send(peer, data, data.shape[1] - 500)
            until(lambda: "record-continued" in {e.kind for e in session.events()}, "the record to continue")
    run = RunRecord.open(session.run)
    assert run.summary["counts"]["samples"] == data.shape[1]
    left_out = run.summary["left_out_samples"]
    assert 3 * WINDOW <= left_out <= 4 * WINDOW
    responses = run.responses()
    steady = responses[np.flatnonzero(responses.first >= left_out)]
    assert averaged(run).count == len(steady) < len(responses)


def forget_what_was_found(run: Path) -> None:
    """Leave run.json as a disk does that is full from the beginning of a run on."""
    summary = dict(RunRecord.open(run).summary)
    for name in ("left_out_samples", "clock"):
        summary.pop(name, None)
    for name in (RUN, COPY):
        (run / name).write_bytes(to_document(summary))
