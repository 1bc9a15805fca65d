"""What the peers cost, taking turns so that a busy neighbour hits all alike."""

from __future__ import annotations

from functools import partial

from bench.work import side_by_side
from studies.peers import two_mass
from studies.peers.peers import PEERS
from studies.peers.recording import LINES, RATE_HZ, Recording

SECONDS = 1.0  # for each


def per_sample_s(recording: Recording) -> tuple[dict[str, float], float]:
    """Of each peer, per sample of a whole recording; and of one minimal fit among many at once."""
    responses = recording.true_response(recording.judged)
    tasks = {peer.name: partial(peer.estimate, recording) for peer in PEERS}
    tasks["fit"] = partial(two_mass.fit, responses, LINES.frequency_hz, RATE_HZ)
    best = side_by_side(tasks, SECONDS)
    fit_s = best.pop("fit") / len(responses)
    return {name: time_s / len(recording.block) for name, time_s in best.items()}, fit_s
