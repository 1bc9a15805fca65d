"""Compare a configuration with the spectra of its drive: settings that differ, or need samples, are rejected."""

from __future__ import annotations

from livebode.configuration import Axis
from livebode.core import ConfigError, Lines, SpectraLayout


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
