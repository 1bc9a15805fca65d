"""The follower of an axis: of a recording, of the samples of a live source, or of the spectra of a drive."""

from __future__ import annotations

from livebode import estimation
from livebode.configuration import Axis
from livebode.core import ConfigError, Lines, SpectraLayout
from livebode.estimation import Follower, Settings, Tracker, nearest_hop
from livebode.preparation.plan import make_lines, recorded_hop, settings_of
from livebode.sources import Log

LIVE_RESPONSES_PER_S = 20.0
"""Default for a live source: sufficient for display, with a tenth of the work of a hop of a twentieth of the window."""


def make_follower(axis: Axis, log: Log) -> Follower:
    """A Tracker for this recording, or with [motion] a MotionCorrection; LivebodeError if they do not fit."""
    return follower_of(axis, make_settings(axis, log))


def live_follower(axis: Axis, rate_hz: float, layout: SpectraLayout | None = None) -> Follower:
    """A follower of samples, whose lines and window must be given, or of spectra of a layout.

    LivebodeError if they do not fit.
    """
    if layout is not None:
        lines = check_spectra(axis, layout, rate_hz)
        return estimation.SpectraTracker(settings_of(axis, rate_hz, lines, layout.hop), layout)
    frequencies, window = axis.lines.frequencies, axis.lines.window
    if frequencies == "auto" or window == "auto":
        raise ConfigError(
            "auto-needs-recording",
            "lines or window are 'auto', which needs a recording",
            "set lines.frequencies and lines.window for a live source",
            key="lines",
        )
    lines = Lines.parse(frequencies, rate_hz, window, rounded=not axis.tracking.periodic)
    hop = axis.tracking.hop or nearest_hop(lines.window, rate_hz / LIVE_RESPONSES_PER_S)
    return follower_of(axis, settings_of(axis, rate_hz, lines, hop))


def follower_of(axis: Axis, settings: Settings) -> Follower:
    """What follows samples with these settings of the axis; ConfigError if its [motion] does not fit them."""
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
    lines = make_lines(axis, log)
    return settings_of(axis, log.rate_hz, lines, recorded_hop(axis, log, lines))


def check_spectra(axis: Axis, layout: SpectraLayout, rate_hz: float) -> Lines:
    """The lines of the spectra; ConfigError if the configuration has other lines, or settings that need samples."""
    frequencies, window, hop = axis.lines.frequencies, axis.lines.window, axis.tracking.hop
    if axis.motion is not None:
        raise ConfigError(
            "needs-samples",
            "[motion] needs samples for its model, but the drive sends spectra",
            "remove it, or send samples",
            key="motion",
        )
    if not axis.tracking.periodic:
        raise ConfigError(
            "needs-samples",
            f"tracking.estimator = {axis.tracking.estimator!r} needs samples, but the drive sends spectra",
            "use 'joint', or send samples",
            key="tracking.estimator",
        )
    if axis.record is not None and axis.record.samples:
        raise ConfigError(
            "needs-samples",
            "record.samples records samples, but the drive sends spectra",
            "remove it, or send samples",
            key="record.samples",
        )
    if axis.signals.ready is not None:
        raise ConfigError(
            "needs-samples",
            f"signals.ready = {axis.signals.ready!r} needs samples of the machine's state, but the drive sends spectra",
            "remove it, or send samples",
            key="signals.ready",
        )
    if window not in ("auto", layout.window):
        raise _differs("lines.window", window, layout.window)
    if hop not in (None, layout.hop):
        raise _differs("tracking.hop", hop, layout.hop)
    lines = layout.at(rate_hz)
    if frequencies != "auto" and Lines.parse(frequencies, rate_hz, layout.window).bins != layout.lines:
        f = ", ".join(f"{x:g}" for x in lines.frequency_hz[:20])
        more = f" … ({len(lines)} lines)" if len(lines) > 20 else ""
        raise _differs("lines.frequencies", frequencies, f"{f}{more} Hz")
    return lines


def _differs(key: str, value: int | str | None, sent: int | str) -> ConfigError:
    message = f"{key} = {value!r}, but the drive sends {sent}"
    return ConfigError("value-mismatch", message, "use that, or remove the key", key=key, value=value, allowed=sent)
