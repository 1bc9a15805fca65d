"""The results of the run as Markdown: tables, targets, and the best method in each case."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple

import numpy as np

from studies.peers.estimates import Peer
from studies.peers.peers import FILTER, OURS, PEERS, TEXTBOOK, TUNED
from studies.peers.recording import RATE_HZ, Case
from studies.peers.score import Score

Scores = Mapping[str, Score]  # by the peer's name
# Method, and the required ratio of its error in Keff to that of livebode, or the reverse.
TARGETS = (
    (TEXTBOOK, "≥", 50.0, "better than"),
    (TUNED, "≥", 1.8, "better than"),
    (FILTER, "≤", 1.1, "the error of"),
)
COLUMNS = ("magnitude, dB", "Keff, %", "Js, %")


def errors(scores: Scores) -> str:
    return _rows(("", *COLUMNS), [[name, *map(_number, astuple(score))] for name, score in scores.items()])


def terms(costs_s: Mapping[str, float], delays: Mapping[str, tuple[float, float]]) -> str:
    """Cost and required inputs of each method."""
    heads = ("", "delay, ms", "cost, ns per sample", "in", "required inputs")
    return _rows(heads, [_term(peer, costs_s[peer.name], delays[peer.name]) for peer in PEERS])


def _term(peer: Peer, cost_s: float, delay: tuple[float, float]) -> list[str]:
    known, waits = (1e3 * samples / RATE_HZ for samples in delay)
    late = f"{known:.0f}" + (f", with the stroke up to {known + waits:.0f}" if waits else "")
    return [peer.name, late, f"{1e9 * cost_s:.0f}", peer.language, peer.inputs]


def targets(scores: Scores) -> str:
    """Each livebode method compared with the three methods that the targets name."""
    heads = ["", *(f"{sign} {bound:g} × {what} {name}" for name, sign, bound, what in TARGETS)]
    ours = [name for name in scores if name.startswith(OURS)]
    return _rows(tuple(heads), [[name, *(_verdict(scores, name, target) for target in TARGETS)] for name in ours])


def _verdict(scores: Scores, ours: str, target: tuple[str, str, float, str]) -> str:
    name, sign, bound, _ = target
    ratio = scores[name].stiffness_percent / scores[ours].stiffness_percent
    found, met = (ratio, ratio >= bound) if sign == "≥" else (1 / ratio, 1 / ratio <= bound)
    return f"{found:.2f} {'met' if met else 'missed'}"


def winners(results: Mapping[Case, Scores]) -> str:
    """For each case and column the best peer and the best of livebode."""
    rows = []
    for case, scores in results.items():
        for i, column in enumerate(COLUMNS):
            found = {name: astuple(score)[i] for name, score in scores.items()}
            if not any(np.isnan(value) for value in found.values()):
                rows.append([f"{case.name}: {column}", *_best(found, False), *_best(found, True)])
    return _rows(("", "best peer", "", "best of livebode", ""), rows)


def _best(found: Mapping[str, float], ours: bool) -> list[str]:
    name = min((name for name in found if name.startswith(OURS) == ours), key=lambda name: found[name])
    return [name, _number(found[name])]


def _number(value: float) -> str:
    return "–" if np.isnan(value) else f"{value:.2f}" if value < 10 else f"{value:.0f}"


def _rows(heads: tuple[str, ...], rows: list[list[str]]) -> str:
    return "\n".join("| " + " | ".join(row) + " |" for row in [list(heads), ["---"] * len(heads), *rows])
