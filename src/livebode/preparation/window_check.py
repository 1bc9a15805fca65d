"""Whether the excitation repeats with a window that a person specified."""

from __future__ import annotations

import numpy as np

from livebode.core import Event
from livebode.estimation import Settings

_LAGS = 8  # samples around the window in which another period is searched
_ROUNDING = 1e-12
WINDOWS_COMPARED = 4


def window_doubt(samples: np.ndarray, settings: Settings) -> list[Event]:
    """An event if the beginning of an excitation repeats better after another number of samples than the window.

    With a window that is wrong by one sample, every estimate is wrong by more than its bounds, without other symptoms.
    The run continues, because the person may know better: with hum, the recording repeats after a longer time than the
    excitation.
    """
    window = settings.lines.window
    lags = range(max(1, window - _LAGS), window + _LAGS + 1)
    if samples.size < window + _LAGS + window // 2:
        return []
    differences = {lag: _difference(samples, lag, window + _LAGS) for lag in lags}
    best = min(differences, key=lambda lag: (differences[lag], abs(lag - window)))
    changes = differences[window] / 2
    if differences[window] <= _ROUNDING or differences[best] >= changes:
        return []
    message = (
        f"{settings.excitation!r} repeats every {best} samples rather than every {window}: "
        f"{100 * changes:.2g} % of its power changes from one window to the next, "
        f"{100 * differences[best] / 2:.2g} % from one such period to the next; "
        "compare lines.window with the design of the excitation"
    )
    facts = {"window": window, "period": best, "share_that_changes": changes}
    return [Event("window-doubtful", 0, 0.0, message, facts)]


def _difference(samples: np.ndarray, lag: int, ahead: int) -> float:
    """Mean square of x(n + lag) − x(n) over that of x, over as many samples for every lag up to `ahead`."""
    n = samples.size - ahead
    rest = samples[lag : lag + n] - samples[:n]
    rest = rest[np.isfinite(rest)]
    power = float(np.nanvar(samples))
    return float(np.dot(rest, rest)) / (rest.size * power) if rest.size and power > 0 else 0.0
