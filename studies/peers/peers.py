"""The compared methods, in the order of the table. To add a method, add an entry here."""

from __future__ import annotations

from functools import partial

from studies.peers import kalman, least_squares, moving, rls, sliding_welch, smoother
from studies.peers.compiled import LANGUAGE
from studies.peers.estimates import Peer
from studies.peers.tracked import by, track

_DATED = "its delay"
_ARX = f"the band, a rate, an order, a memory, {_DATED}"
_FILTER = (
    "two masses and dry friction as structure, the radius, starting values, the noise, the random walks of nine states"
)
_LINES = "the lines and their window"
_POSITION = "two masses as structure, the duration of a stroke, the cart's position as a signal"

PEERS = (
    Peer("RLS, textbook", rls.textbook, "an order, a memory", LANGUAGE),
    Peer("RLS, tuned", rls.tuned, _ARX, LANGUAGE),
    Peer("ARX, sliding least squares", least_squares.sliding, _ARX, "NumPy"),
    Peer("Welch, sliding, 200 ms", sliding_welch.sliding, f"{_LINES}, {_DATED}", "SciPy"),
    Peer(
        "EKF, two masses, tuned",
        kalman.tuned,
        _FILTER,
        LANGUAGE,
    ),
    Peer("EKF, smoothed over the stroke", smoother.by_stroke, f"{_FILTER}, the duration of a stroke", LANGUAGE),
    Peer("livebode", by(track), _LINES, "C"),
    Peer("livebode, Hann", by(partial(track, hann=True)), _LINES, "C"),
    Peer("livebode, Hann, best effective time", by(partial(track, hann=True), 260.0), f"{_LINES}, {_DATED}", "C"),
    Peer(
        "livebode, Hann, 200 ms, best effective time",
        by(partial(track, hann=True, window=800), 460.0),
        f"{_LINES}, {_DATED}",
        "C",
    ),
    Peer("livebode, corrected", moving.corrected, f"{_LINES}, {_POSITION}", "C, NumPy"),
    Peer("livebode, moving model", moving.model, f"{_LINES}, {_POSITION}, the radius", "C, NumPy"),
)
TEXTBOOK, TUNED, FILTER = "RLS, textbook", "RLS, tuned", "EKF, two masses, tuned"
OURS = "livebode"
