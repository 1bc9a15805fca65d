"""Welch's method in a sliding window, by scipy.signal.csd: the quotient S_wy/S_wu at the lines."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.signal import csd

from studies.peers.arx import rows
from studies.peers.estimates import Estimates
from studies.peers.recording import LINES, RATE_HZ, Recording

SEGMENT = LINES.window
WINDOW = 2 * SEGMENT  # three Hann segments that overlap by half
DELAY = 460.0


def sliding(recording: Recording) -> Estimates:
    block = recording.block
    newest, _ = rows(len(block))
    whole = newest >= WINDOW - 1
    w, u, y = (sliding_window_view(block[name], WINDOW)[newest[whole] - WINDOW + 1] for name in ("w", "u", "velocity"))
    value = np.full((len(newest), len(LINES)), np.nan + 0j)
    value[whole] = _cross(w, y) / _cross(w, u)
    return Estimates(newest, DELAY, value)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    _, power = csd(a, b, fs=RATE_HZ, nperseg=SEGMENT, noverlap=SEGMENT // 2)
    return power[:, list(LINES.bins)]
