"""The recording of an output-only run, the settings for it, and the band that follows from its power."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from livebode.arrays import Floats
from livebode.configuration import Axis
from livebode.core import UsageError, needing
from livebode.preparation import beginnings, chosen_part
from livebode.runtime import Destination, ExaminedRecording, dated, of_log
from livebode.sources import Log
from livebode_modes.estimate import OutputOnly
from livebode_modes.output_only_settings import OVERSAMPLING, OutputOnlySettings, reduced, window_of
from livebode_modes.reduction import lost_samples

with needing("SciPy", "analysis", "a run from the outputs alone"):
    import scipy  # its parts are loaded when they are first used


_POWER = 0.99  # share of the power above the median that the band contains
_MARGIN = 1.25  # the band ends above the frequency that this power reaches
_SEGMENT = 1 << 12


def proposed_band(y: Floats, rate_hz: float) -> tuple[float, float]:
    """The band from a fortieth of its upper limit to 1.25 times the frequency below which 99 % of the power is.

    The power is that above the noise floor, the median of the spectrum, of each output relative to its own.

    Parameters
    ----------
    y
        Outputs, (outputs, samples); samples that are not finite count as 0.
    """
    if y.shape[1] < 2:
        return rate_hz / OVERSAMPLING / 40, rate_hz / OVERSAMPLING
    y = y - np.nanmean(np.where(np.isfinite(y), y, np.nan), axis=1, keepdims=True)
    y = np.where(np.isfinite(y), y, 0.0)
    f, power = scipy.signal.welch(y, rate_hz, nperseg=min(_SEGMENT, y.shape[1]), axis=1)
    above = np.maximum(power[:, 1:] - np.median(power[:, 1:], axis=1, keepdims=True), 0.0)
    share = (above / np.maximum(above.sum(axis=1, keepdims=True), np.finfo(float).tiny)).mean(axis=0)
    reached = int(np.searchsorted(np.cumsum(share), _POWER * share.sum()))
    high_hz = min(_MARGIN * float(f[1:][min(reached, len(f) - 2)]), rate_hz / OVERSAMPLING)
    return high_hz / 40, high_hz


_SEARCHED = 1 << 20  # samples of each output, for the default of the band


def examined_outputs(axis: Axis, logs: Sequence[Log], to: Destination) -> ExaminedRecording:  # noqa: ARG001
    """A recording, which is tracked at once."""
    (log,) = logs
    log = output_only_part(axis, log)
    estimate = OutputOnly(axis, output_only_settings(axis, log))
    log = log.naming(estimate.channels)
    return ExaminedRecording(axis, log, estimate, of_log(log), log.clock_kind, dated(log))


def output_only_settings(axis: Axis, log: Log) -> OutputOnlySettings:
    """Outputs, band and window; LivebodeError if they do not fit the recording."""
    section = axis.output_only
    assert section is not None
    outputs = (axis.signals.output, *section.others)
    samples = None if log.stop is None else log.stop - log.first
    if section.band_hz is None or samples is None:
        searched = beginnings(log, list(dict.fromkeys(outputs)), _SEARCHED)
        if searched.shape[1] < _SEARCHED:  # all of a file whose length only reading gives
            samples = searched.shape[1]
    low_hz, high_hz = proposed_band(searched, log.rate_hz) if section.band_hz is None else section.band_hz
    factor = reduced(log.rate_hz, high_hz)
    window = None if axis.lines.window == "auto" else axis.lines.window
    hop_samples, hops = window_of(factor, window, axis.tracking.hop, samples, lost_samples(factor))
    return OutputOnlySettings(
        outputs, log.rate_hz, (low_hz, high_hz), factor, hop_samples, hops, schedule=axis.signals.schedule
    )


def output_only_part(axis: Axis, log: Log) -> Log:
    """The part in [source]; UsageError if it is in periods, which an output does not have."""

    def no_periods(_: Log) -> tuple[int, int]:
        raise UsageError(
            "unreadable",
            "the part is in periods, but without an excitation there is no period",
            "give seconds or samples",
            argument="from",
        )

    return chosen_part(log, axis.source.from_, axis.source.to, 0, no_periods)
