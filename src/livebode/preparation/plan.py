"""Settings of a tracker from an Axis and its recording; "auto" values are determined here, specified ones compared."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np

from livebode.configuration import Axis
from livebode.core import ANY_EXCITATION, Block, ConfigError, Event, Lines
from livebode.estimation import FORGETTING, RippleOrder, Settings, divisors, quarter_hop
from livebode.language import Message
from livebode.preparation.checks import check_length
from livebode.preparation.roles import ROLES, check_distinct, check_roles, period_of
from livebode.sources import Log

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
    power = float(np.nanvar(samples))
    differences = {lag: _difference(samples, lag, window + _LAGS, power) for lag in lags}
    best = min(differences, key=lambda lag: (differences[lag], abs(lag - window)))
    if differences[window] <= _ROUNDING or differences[best] >= differences[window] / 2:
        return []
    return [_doubt(settings, best, differences[window] / 2, differences[best] / 2)]


def divided_window(samples: np.ndarray, settings: Settings) -> list[Event]:
    """An event if a whole number of the excitation's periods, as `recognise` finds it, is not the window."""
    window, period = settings.lines.window, period_of(samples, settings.lines.rate_hz)
    if period is None:  # the person knows better
        return []
    longest = max(window, period)
    if window % period == 0 or samples.size <= longest:
        return []
    power = float(np.nanvar(samples))
    changes, rest = (_difference(samples, lag, longest, power) / 2 for lag in (window, period))
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


def _difference(samples: np.ndarray, lag: int, ahead: int, power: float) -> float:
    """Mean square of x(n + lag) − x(n) over the power of x, over as many samples for every lag up to `ahead`."""
    n = samples.size - ahead
    rest = samples[lag : lag + n] - samples[:n]
    rest = rest[np.isfinite(rest)]
    return float(np.dot(rest, rest)) / (rest.size * power) if rest.size and power > 0 else 0.0


RECORDED_VALUES_MAX = 1 << 19
"""Responses × lines that a recording has by default, about 19 MB of its run."""


def recorded_hop(axis: Axis, log: Log, lines: Lines) -> int | None:
    """Hop of a recording unless it is specified: a quarter of the window; longer above `RECORDED_VALUES_MAX`.

    It divides the window, and is the window at most, so that every sample counts. A machine that moves, or whose
    changes are timed, has a twentieth of the window: None.
    """
    if axis.tracking.hop or is_timed(axis):
        return None
    usual, least = quarter_hop(lines.window), (log.samples or 0) * len(lines) / RECORDED_VALUES_MAX
    if least <= usual:
        return usual
    return next((hop for hop in divisors(lines.window) if hop >= least), lines.window)


def is_timed(axis: Axis) -> bool:
    """Whether the moment of a response counts: of a machine that moves, or whose changes are timed."""
    return bool(axis.signals.schedule or axis.motion or axis.monitoring.baseline or axis.signals.ready)


def hop_event(axis: Axis, log: Log, settings: Settings) -> list[Event]:
    """An event if the hop is that of a long recording."""
    usual = quarter_hop(settings.lines.window)
    if settings.step <= usual or settings.step != recorded_hop(axis, log, settings.lines):
        return []
    message = Message(
        "the recording is long: it has a response every {hop} samples, so that the run is small; --hop {usual} gives "
        "the usual number",
        hop=settings.step,
        usual=usual,
    )
    return [Event("long-recording", 0, 0.0, message)]


SEARCHED = 1 << 22
"""Samples that "auto" and `inspect` use: half an hour at 2 kHz, and 100 MB of work."""
_ROLES_SAMPLES, _ROLES_WINDOWS = 1 << 17, 32  # to judge the roles, whichever is longer


class RecordedSource(Protocol):
    """A source of Blocks that begins at its sample `first`."""

    @property
    def first(self) -> int: ...

    def blocks(self, channels: Sequence[str] | None = None) -> Iterator[Block]: ...


def window_in_doubt(axis: Axis, log: Log, settings: Settings) -> list[Event]:
    """An event if the excitation does not repeat with the window that the configuration specifies."""
    if settings.method.reference != "excitation" or not settings.excitation or axis.lines.window == "auto":
        return []
    if not settings.periodic:
        return []
    if axis.lines.frequencies == "auto":
        return divided_window(beginning(log, settings.excitation), settings)
    samples = beginning(log, settings.excitation, WINDOWS_COMPARED * settings.lines.window)
    return window_doubt(samples, settings)


def settings_of(axis: Axis, rate_hz: float, lines: Lines, hop: int | None = None) -> Settings:
    """The tracker's settings with these lines and hop; LivebodeError if they do not fit each other."""
    signals, tracking = axis.signals, axis.tracking
    settings = Settings(
        lines=lines,
        output=signals.output,
        input=signals.input,
        excitation=signals.excitation,
        schedule=signals.schedule,
        estimator=tracking.estimator,
        loop=axis.loop.build(rate_hz),
        quantity=tracking.quantity,
        hop=hop or tracking.hop,
        average=tracking.average,
        forgetting=tracking.forgetting or (1.0 if tracking.average and not axis.source.live else FORGETTING),
        noise=tracking.noise,
        differenced=tuple(tracking.differenced),
        hann=tracking.hann,
        spikes=tuple(tracking.spikes),
        dtype=tracking.dtype,
        ripple=_ripple(axis),
    )
    if not tracking.accept_roles:
        check_distinct(settings)
    return settings


def _ripple(axis: Axis) -> tuple[RippleOrder, ...]:
    """Ripple orders from the configuration, else those that its baseline has learned."""
    if axis.tracking.ripple or axis.monitoring.baseline is None or axis.signals.schedule is None:
        return tuple(RippleOrder(*order) for order in axis.tracking.ripple)
    from livebode.monitoring import Baseline  # with the simulation

    machine = Baseline.load(axis.monitoring.baseline).machine
    if machine is None:
        return ()
    amplitudes = machine.ripple.amplitude_n_m * 2**0.5  # of sine and cosine each
    return tuple(RippleOrder(float(k), float(a)) for k, a in zip(machine.ripple.cycles_per_m, amplitudes) if a > 0)


def reference_of(axis: Axis) -> str | None:
    """Channel whose periods count: the excitation, or the input of a direct estimate."""
    return axis.signals.input if axis.tracking.estimator == "direct" else axis.signals.excitation


def auto_reference(axis: Axis) -> str:
    """The same for a window and lines that are 'auto'; ConfigError if it is not named."""
    name = reference_of(axis)
    if name is None:
        key = "signals.input" if axis.tracking.estimator == "direct" else "signals.excitation"
        raise ConfigError(
            "auto-needs-recording",
            f"lines or window are 'auto', but {key} is missing",
            f"{ANY_EXCITATION}, otherwise name its channel",
            key=key,
        )
    return name


def make_lines(axis: Axis, log: Log) -> Lines:
    """The lines of the configuration, or those of the recording; LivebodeError if there are none."""
    frequencies, window = axis.lines.frequencies, axis.lines.window
    check_length(log.samples, 0 if window == "auto" else window, axis.tracking.hop)
    if frequencies != "auto" and window != "auto":
        return Lines.parse(frequencies, log.rate_hz, window)
    reference = auto_reference(axis)
    # Its statistics take half a second to import; a run with known lines does not need them.
    from livebode.excitation import lines_of_window, recognise

    samples = beginning(log, reference)
    if window != "auto":
        return lines_of_window(samples, window, log.rate_hz)
    if frequencies == "auto":
        answer = beginning(log, axis.signals.output)
        known = answer[np.isfinite(answer)]
        # A constant output is refused with its name when all of it has been read.
        return recognise(samples, log.rate_hz, answer if known.size and np.ptp(known) else None).lines
    return Lines.parse(frequencies, log.rate_hz, recognise(samples, log.rate_hz, doubtful=True).period)


def beginning(log: RecordedSource, channel: str, samples: int = SEARCHED) -> np.ndarray:
    """The first samples of a channel, from `log.first` on, with NaN where some are missing."""
    return np.asarray(beginnings(log, [channel], samples)[0])


def beginnings(log: RecordedSource, channels: Sequence[str], samples: int) -> np.ndarray:
    """The same of several channels, shape (channels, samples)."""
    return joined(log, channels, samples)[0]


def joined(log: RecordedSource, channels: Sequence[str], samples: int) -> tuple[np.ndarray, list[int]]:
    """The same, and the places of gaps in which no sample is missing, as between two records of one file."""
    parts: list[np.ndarray] = []
    seams: list[int] = []
    size = 0
    for block in log.blocks(list(channels)):
        missing = block.start - log.first - size
        seams += [size] * (block.gap and missing == 0)
        parts += [np.full((len(channels), missing), np.nan), np.array([block[name] for name in channels])]
        size = block.stop - log.first
        if size >= samples:
            break
    return (np.concatenate(parts, axis=1)[:, :samples] if parts else np.zeros((len(channels), 0))), seams


def roles_in_doubt(axis: Axis, log: Log, settings: Settings) -> list[str]:
    """Doubts about the roles of the channels, as sentences; SignalError if one is certain and not accepted."""
    names = {role: name for role in ROLES if (name := settings.channel(role))}
    samples = min(SEARCHED, max(_ROLES_SAMPLES, _ROLES_WINDOWS * settings.lines.window)) + 1
    channels = list(dict.fromkeys(names.values()))
    ready = axis.ready
    data = beginnings(log, channels if ready is None else [*channels, ready.channel], samples)
    if ready is not None:
        holds = ready.holds(data[-1])
        if not holds.any():
            return []
        data = np.where(holds, data[:-1], np.nan)
    rows = dict(zip(channels, data))
    signals = {role: rows[name] for role, name in names.items()}
    return check_roles(signals, settings, log.naming(channels).channels, accepted=axis.tracking.accept_roles)
