"""Spikes in the first periods of a recording, which a causal gate cannot detect yet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.estimation import Settings, SpikeGate
from livebode.excitation import filled
from livebode.preparation.aligned import AlignedLog
from livebode.preparation.plan import beginnings

_PERIODS, _PERIODS_MIN = 18, 12  # that are searched, backwards
_EARLY = 9  # periods after which the gate has learned the usual level


def early_spikes(log: AlignedLog, settings: Settings) -> NDArray[np.int64]:
    """Numbers of spikes in the first nine periods, by the same gate from the end to the beginning, ascending.

    None for fewer than twelve periods, or without `settings.spikes`.
    """
    window, none = settings.lines.window, np.zeros(0, dtype=np.int64)
    if not settings.spikes:
        return none
    held = beginnings(log, settings.spikes, _PERIODS * window)
    count = held.shape[1] // window
    if count < _PERIODS_MIN or not np.isfinite(held).any(axis=1).all():
        return none
    signals = np.array([_as_watched(name, x[: count * window], settings) for name, x in zip(settings.spikes, held)])
    gate = SpikeGate(np.ones(len(signals), dtype=np.bool_), window)
    found = np.sort(count * window - 1 - gate.process(signals[:, ::-1]))
    return np.asarray(log.first + found[found < _EARLY * window], dtype=np.int64)


def _as_watched(name: str, x: NDArray[np.float64], settings: Settings) -> NDArray[np.float64]:
    whole = filled(x)
    return np.diff(whole, prepend=whole[0]) if name in settings.differenced else whole
