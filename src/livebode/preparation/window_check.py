"""Whether the excitation repeats with a window that a person specified."""

from __future__ import annotations

import numpy as np

from livebode.core import Event, LivebodeError
from livebode.estimation import Settings
from livebode.language import Message

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
    if differences[window] <= _ROUNDING or differences[best] >= differences[window] / 2:
        return []
    return [_doubt(settings, best, differences[window] / 2, differences[best] / 2)]


def divided_window(samples: np.ndarray, settings: Settings) -> list[Event]:
    """An event if a whole number of the excitation's periods, as `recognise` finds it, is not the window."""
    from livebode.excitation import recognise  # its statistics are slow to import

    window = settings.lines.window
    try:
        period = recognise(samples, settings.lines.rate_hz, doubtful=True).period
    except LivebodeError:  # the person knows better
        return []
    longest = max(window, period)
    if window % period == 0 or samples.size <= longest:
        return []
    changes, rest = (_difference(samples, lag, longest) / 2 for lag in (window, period))
    return [_doubt(settings, period, changes, rest)]


def _doubt(settings: Settings, period: int, changes: float, rest: float) -> Event:
    window = settings.lines.window
    message = Message(
        "{channel} repeats every {period} samples rather than every {window}: {changes_percent:.2g} % of its "
        "power changes from one window to the next, {rest_percent:.2g} % from one such period to the next; "
        "compare lines.window with the design of the excitation",
        channel=repr(settings.excitation),
        period=period,
        window=window,
        changes_percent=100 * changes,
        rest_percent=100 * rest,
    )
    facts = {"window": window, "period": period, "share_that_changes": changes}
    return Event("window-doubtful", 0, 0.0, message, facts)


def _difference(samples: np.ndarray, lag: int, ahead: int) -> float:
    """Mean square of x(n + lag) − x(n) over that of x, over as many samples for every lag up to `ahead`."""
    n = samples.size - ahead
    rest = samples[lag : lag + n] - samples[:n]
    rest = rest[np.isfinite(rest)]
    power = float(np.nanvar(samples))
    return float(np.dot(rest, rest)) / (rest.size * power) if rest.size and power > 0 else 0.0
