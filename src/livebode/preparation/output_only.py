"""Settings of an output-only run from an Axis and its recording."""

from __future__ import annotations

from livebode.configuration.axis import Axis
from livebode.core import UsageError
from livebode.output_only import OutputOnlySettings, lost_samples, proposed_band, reduced, window_of
from livebode.preparation.part import chosen_part
from livebode.preparation.plan import beginnings
from livebode.sources import Log

_SEARCHED = 1 << 20  # samples of each output, for the default of the band


def output_only_settings(axis: Axis, log: Log) -> OutputOnlySettings:
    """Outputs, band and window; LivebodeError if they do not fit the recording."""
    section = axis.output_only
    assert section is not None
    outputs = (axis.signals.output, *section.others)
    if section.band_hz is not None:
        low_hz, high_hz = section.band_hz
    else:
        low_hz, high_hz = proposed_band(beginnings(log, list(dict.fromkeys(outputs)), _SEARCHED), log.rate_hz)
    factor = reduced(log.rate_hz, high_hz)
    window = None if axis.lines.window == "auto" else axis.lines.window
    samples = None if log.stop is None else log.stop - log.first
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
