"""The contenders, in the order of the table. One more is one more entry here."""

from __future__ import annotations

from functools import partial

from studies.peers import kalman, least_squares, moving, rls, sliding_welch, smoother
from studies.peers.compiled import LANGUAGE
from studies.peers.estimates import Peer
from studies.peers.tracked import by, track

_DATED = "how late it is"
_ARX = f"the band, a rate, an order, a memory, {_DATED}"
_FILTER = (
    "that there are two masses and dry friction, the radius, starting values, the noise, how fast each of nine states "
    "may wander"
)
_LINES = "the lines and their window"
_POSITION = "that there are two masses, how long a stroke is, the cart's position as a signal"

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
    Peer("EKF, smoothed over the stroke", smoother.by_stroke, f"{_FILTER}, how long a stroke is", LANGUAGE),
    Peer("livebode", by(track), _LINES, "C"),
    Peer("livebode, Hann", by(partial(track, hann=True)), _LINES, "C"),
    Peer("livebode, Hann, dated as it fits best", by(partial(track, hann=True), 260.0), f"{_LINES}, {_DATED}", "C"),
    Peer(
        "livebode, Hann, 200 ms, dated so too",
        by(partial(track, hann=True, window=800), 460.0),
        f"{_LINES}, {_DATED}",
        "C",
    ),
    Peer("livebode, corrected", moving.corrected, f"{_LINES}, {_POSITION}", "C, NumPy"),
    Peer("livebode, moving model", moving.model, f"{_LINES}, {_POSITION}, the radius", "C, NumPy"),
)
TEXTBOOK, TUNED, FILTER = "RLS, textbook", "RLS, tuned", "EKF, two masses, tuned"
OURS = "livebode"
