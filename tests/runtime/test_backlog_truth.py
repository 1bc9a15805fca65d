"""A live run that is behind leaves out fits first, reports it, and loses no sample; a full queue drops whole spans."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from livebode.records import RunRecord, each_event
from livebode.sources.live.inbox import INBOX_S_MAX, Inbox
from tests.support.live_session import LiveSession, Stuck, hurried
from tests.support.peers.peer import PATIENCE_S, RATE_HZ, batches, until
from tests.support.peers.plain import TcpPeer

BATCHES = 60
"""Half a minute of the machine, which may wait."""


def test_fits_are_left_out_and_no_sample_is_lost(tmp_path: Path) -> None:
    stuck, lines = Stuck(), {"frequencies": "50:500:50", "window": 400}
    with (
        TcpPeer(tmp_path) as peer,
        LiveSession(tmp_path, peer, stuck, lines=lines, fit={"model": "two-mass-gain"}) as session,
    ):
        peer.wait_ready()
        for batch in batches(12, first=0):
            peer.send(batch)
        assert stuck.held.wait(PATIENCE_S)
        source = session.control.source
        for batch in hurried(BATCHES, 12 * 50):
            peer.send(batch)
        until(lambda: source.health.waiting_s > 29.0, "half a minute to wait")
        stuck.released.set()
        until(lambda: not source.health.waiting_s, "the queue to be empty")
    run = RunRecord.open(tmp_path / "run")
    assert run.found["hop"] == RATE_HZ / 20
    assert run.summary["counts"]["missing"] == run.summary["source"]["lost"] == 0
    events = [one for event in run.events() for one in each_event(event)]
    backlog, cleared = (next(e for e in events if e.kind == kind) for kind in ("backlog", "backlog-cleared"))
    assert backlog.details["backlog_s"] > 10.0
    assert cleared.details["longest_s"] >= backlog.details["backlog_s"]
    responses = len(run.responses())
    left_out = sum(event.details["fits"] for event in events if event.kind == "thinned")
    fitted = sum(run.summary["fit"]["statuses"].values())
    assert fitted + left_out == responses
    assert left_out >= 20 * 19  # none is fitted while it is 8 s behind or more
    groups = {e.kind: e.details["group"].partition("@")[0] for e in run.events() if e.kind in ("backlog", "thinned")}
    assert groups == {"backlog": "backlog", "thinned": "thinned"}  # what is left out hides no alarm


def test_a_full_queue_drops_whole_spans() -> None:
    inbox, taken = Inbox(), []
    for turn, batch in enumerate(hurried(1200, 0)):  # ten minutes, twice as fast as they are taken
        taken += [batch] if inbox.put(batch, wait=False) else []
        if turn % 2:
            assert inbox.get(0.0) is not None
    starts = np.array([batch.first_sample for batch in taken])
    edges = [0, *(np.flatnonzero(np.diff(starts) > 2000) + 1), len(starts)]
    assert len(edges) > 5
    whole_s = [(starts[stop - 1] + 2000 - starts[start]) / RATE_HZ for start, stop in pairwise(edges)]
    lost_s = np.diff(starts)[np.array(edges[1:-1]) - 1] / RATE_HZ - 0.5
    # A quarter of the queue fills at half the pace at which it empties, and the other way round.
    assert min(whole_s[:-1]) >= INBOX_S_MAX / 4
    assert min(lost_s) >= INBOX_S_MAX / 4
