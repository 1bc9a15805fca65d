"""Settings of a tracker from an Axis and its recording; "auto" values are determined here."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np

from livebode import estimation
from livebode.configuration import Axis
from livebode.core import ANY_EXCITATION, Block, ConfigError, Event, Lines
from livebode.estimation import Follower, RippleOrder, Settings, Tracker
from livebode.preparation.checks import check_length
from livebode.preparation.roles import ROLES, check_distinct, check_roles
from livebode.preparation.window_check import WINDOWS_COMPARED, divided_window, window_doubt
from livebode.sources import Log

SEARCHED = 1 << 22
"""Samples that "auto" and `inspect` use: half an hour at 2 kHz, and 100 MB of work."""
_ROLES_SAMPLES, _ROLES_WINDOWS = 1 << 17, 32  # to judge the roles, whichever is longer


class RecordedSource(Protocol):
    """A source of Blocks that begins at its sample `first`."""

    @property
    def first(self) -> int: ...

    def blocks(self, channels: Sequence[str] | None = None) -> Iterator[Block]: ...


def make_follower(axis: Axis, log: Log) -> Follower:
    """A Tracker for this recording, or with [motion] a MotionCorrection; LivebodeError if they do not fit."""
    return follower_of(axis, make_settings(axis, log))


def follower_of(axis: Axis, settings: Settings) -> Follower:
    """The follower with these settings; ConfigError if the axis has a [motion] that they do not permit."""
    if not settings.periodic:
        if axis.motion is not None:
            raise ConfigError(
                "key-conflict",
                f"[motion] needs an excitation that repeats, but tracking.estimator is {settings.estimator!r}",
                "remove [motion], or choose another estimator",
                key="motion",
            )
        return estimation.NonPeriodicTracker(settings)
    if axis.motion is None:
        return Tracker(settings)
    # The simulation, which its model needs, is slow to import.
    from livebode.motion import MotionCorrection

    chunk_samples = round(axis.motion.chunk_s * settings.lines.rate_hz)
    if chunk_samples < 2 * settings.lines.window:
        raise ConfigError(
            "value-invalid",
            f"motion.chunk_s = {axis.motion.chunk_s:g} is {chunk_samples} samples, less than two windows of "
            f"{settings.lines.window}",
            "set it to the duration of a stroke",
            key="motion.chunk_s",
            value=axis.motion.chunk_s,
            window=settings.lines.window,
        )
    return MotionCorrection(
        settings, radius_m=axis.motion.radius_m, chunk_samples=chunk_samples, driven_by=axis.motion.driven_by
    )


def make_settings(axis: Axis, log: Log) -> Settings:
    """The tracker's settings for this recording; LivebodeError if they do not fit it or each other."""
    if not axis.tracking.periodic:
        from livebode.preparation.nonperiodic import nonperiodic_settings  # loads the method of local polynomials

        return nonperiodic_settings(axis, log)
    return settings_of(axis, log.rate_hz, make_lines(axis, log))


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
        forgetting=tracking.forgetting,
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
    if window != "auto":
        check_length(log.samples, window)
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


def beginning(log: Log, channel: str, samples: int = SEARCHED) -> np.ndarray:
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
