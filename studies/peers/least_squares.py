"""An ARX model by least squares over the newest window, computed again at every row."""

from __future__ import annotations

import numpy as np

from studies.peers.arx import Order, Prepared, rows
from studies.peers.estimates import Estimates
from studies.peers.recording import Recording

ORDER, DELAY = Order(8, 9, first=0), 260.0
BAND = Prepared(15.0, 170.0, every=8, order=4)
WINDOW_S = 0.12


def solve(phi: np.ndarray, y: np.ndarray, last: np.ndarray, window: int) -> np.ndarray:
    """Parameters by the `window` samples up to each of `last`, shape (rows, parameters); NaN before a full window."""
    found = np.full((len(last), phi.shape[1]), np.nan)
    whole = last >= window - 1
    at = last[whole, np.newaxis] - np.arange(window)
    q, r = np.linalg.qr(phi[at])
    found[whole] = np.linalg.solve(r, np.einsum("nij,ni->nj", q, y[at])[..., np.newaxis])[..., 0]
    return found


def sliding(recording: Recording) -> Estimates:
    u, y = BAND.signals(recording.block["u"], recording.block["velocity"])
    newest, kept = rows(len(recording.block), BAND.every)
    theta = solve(ORDER.regressors(u, y), y, kept, round(WINDOW_S * BAND.rate_hz))
    return Estimates(newest, DELAY, ORDER.response(theta, BAND.rate_hz))
