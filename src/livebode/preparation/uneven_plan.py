"""Settings of a tracker for a recording whose channels have clocks of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from livebode.configuration import Axis
from livebode.core import ConfigError, Event, Lines
from livebode.estimation import Settings, divisors
from livebode.language import Message
from livebode.preparation._uneven_grid import PLACES
from livebode.preparation.plan import is_timed, settings_of
from livebode.sources import UnevenLog

_PLACES_UNTIMED = 4
_UNKNOWNS = 300
"""Amplitudes of a window up to which a machine that moves has the hop of even samples; a fit costs their cube."""


def check_uneven(axis: Axis) -> None:
    """ConfigError for a setting that needs samples at regular times."""
    tracking = axis.tracking
    for key, used, why in (
        ("tracking.estimator", not tracking.periodic, f"{tracking.estimator} needs samples at regular times"),
        ("motion", axis.motion is not None, "its model needs samples at regular times"),
        (
            "record.samples",
            axis.record is not None and axis.record.samples,
            "samples are recorded at regular times only",
        ),
        ("tracking.hann", tracking.hann, "a Hann window needs samples at regular times"),
        ("tracking.spikes", bool(tracking.spikes), "spikes are found in samples at regular times"),
        ("signals.ready", axis.signals.ready is not None, "the machine's state is compared sample by sample"),
        ("tracking.dtype", tracking.dtype != "float64", "the least-squares fits are in float64"),
    ):
        if used:
            raise ConfigError(
                "needs-even-samples",
                f"{key} is set, but the channels of this recording have clocks of their own, and {why}",
                "remove it, or resample the recording",
                key=key,
            )


def uneven_settings(axis: Axis, lines: Lines) -> Settings:
    """The settings of the tracker; ConfigError if the hop does not divide the window.

    A differenced channel is fitted with a linear trend instead, which its spectra no longer contain.
    """
    hop = axis.tracking.hop or _default_hop(lines, PLACES if is_timed(axis) else _PLACES_UNTIMED)
    settings = settings_of(axis, lines.rate_hz, lines, hop)
    if settings.step < lines.window and lines.window % settings.step:
        raise ConfigError(
            "value-invalid",
            f"tracking.hop = {settings.step} does not divide the window of {lines.window} samples, which a recording "
            "whose channels have clocks of their own needs",
            "choose a divisor",
            key="tracking.hop",
            value=settings.step,
            window=lines.window,
        )
    return replace(settings, differenced=())


def _default_hop(lines: Lines, places_max: int) -> int:
    """The divisor of the window nearest to its part of so many, or longer where a window has many lines."""
    window, unknowns = lines.window, 2 * len(lines) + 1
    places = max(1.0, min(places_max, PLACES * (_UNKNOWNS / unknowns) ** 3))
    return min(divisors(window), key=lambda d: max(d * places / window, window / (d * places)))


def uneven_event(log: UnevenLog, channels: Sequence[str], lines: Lines) -> Event:
    """An Event that describes the clocks, and how the spectra are computed."""
    clocks = log.clocks(channels)
    message = Message(
        "the channels are sampled at times of their own ({described}), so that spectra are fitted to the samples at "
        "these times; window and hop count samples of a grid of {grid_hz:.9g} Hz",
        described=", ".join(one.described for one in clocks),
        grid_hz=lines.rate_hz,
    )
    slow = [one for one in clocks if one.stamps.rate_hz / 2 <= lines.frequency_hz[-1]]
    if slow:
        nyquist_hz = min(one.stamps.rate_hz for one in slow) / 2
        message = Message(
            "{grid}; lines above {nyquist_hz:.6g} Hz contain what a channel has at their image frequencies",
            grid=message,
            nyquist_hz=nyquist_hz,
        )
    details = {"rate_hz": lines.rate_hz, "window": lines.window, "clocks": clock_facts(log, channels)}
    return Event("uneven-clock", log.first, log.origin_s + log.first / log.rate_hz, message, details)


def clock_facts(log: UnevenLog, channels: Sequence[str]) -> list[dict[str, object]]:
    """The clocks of these channels as plain data."""
    return [
        {
            "time": one.stamps.column,
            "channels": list(one.channels),
            "samples": one.stamps.samples,
            "rate_hz": one.stamps.rate_hz,
            "median_step_s": one.stamps.step_s,
            "step_std_over_median": one.stamps.jitter,
            "longest_step_s": one.stamps.longest_s,
        }
        for one in log.clocks(channels)
    ]
