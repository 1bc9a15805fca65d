"""The recording of an output-only run, and the settings for it."""

from __future__ import annotations

from livebode.configuration import Axis, open_recording, with_shared_names
from livebode.core import UsageError
from livebode.preparation import beginnings, chosen_part
from livebode.runtime import Destination, ExaminedRecording, dated, of_log
from livebode.sources import Log
from livebode_modes.band import proposed_band
from livebode_modes.estimate import OutputOnly
from livebode_modes.reduction import lost_samples
from livebode_modes.settings import OutputOnlySettings, reduced, window_of

_SEARCHED = 1 << 20  # samples of each output, for the default of the band


def examined_outputs(axis: Axis, to: Destination) -> ExaminedRecording:  # noqa: ARG001 - it is tracked at once
    """Open a recording."""
    opened = open_recording(axis)
    axis = with_shared_names(axis, opened)
    log = output_only_part(axis, opened)
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
