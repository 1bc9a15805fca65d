"""Settings for an excitation that does not repeat, with window and lines where they are not specified."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from livebode.configuration import Axis
from livebode.core import ConfigError, Lines, SignalError
from livebode.estimation import WINDOW_MIN, WINDOWS, LocalPolynomial, Settings, quarter_hop, separable
from livebode.preparation.checks import check_length
from livebode.preparation.plan import SEARCHED, is_timed, joined, settings_of
from livebode.sources import Log

LINES_MAX = 1000
"""Lines that are chosen at most, at equal ratios."""
_POWER = 1e-3  # of the excitation's power, in the weakest bins, is left out


def nonperiodic_settings(axis: Axis, log: Log) -> Settings:
    """Settings of the tracker for this recording; lines need not be on its grid.

    With window "auto", one response from the longest stretch without gap.
    """
    frequencies, window = axis.lines.frequencies, axis.lines.window
    windows = WINDOWS if axis.tracking.estimator == "welch" else 1
    hop = None
    if window != "auto":
        check_length(log.samples, windows * window)
        if windows == 1 and not is_timed(axis):
            hop = axis.tracking.hop or quarter_hop(window)
    if frequencies != "auto" and window != "auto":
        return settings_of(axis, log.rate_hz, Lines.parse(frequencies, log.rate_hz, window, rounded=True), hop)
    signals = axis.signals
    reference = signals.input if signals.excitation is None else signals.excitation
    if reference is None:
        raise ConfigError(
            "auto-needs-recording",
            "lines or window are 'auto', but signals.excitation and signals.input are missing",
            "name the channel of the excitation, or in an open loop of the input",
            key="signals.excitation",
        )
    names = list(dict.fromkeys(name for name in (reference, signals.input, signals.output) if name))
    samples, seams = joined(log, names, SEARCHED)
    stretch = whole_stretch(samples, windows * (WINDOW_MIN if window == "auto" else window), seams)
    if window == "auto":
        window = (stretch.stop - stretch.start) // windows
        hop = axis.tracking.hop or windows * window
    if frequencies != "auto":
        lines = Lines.parse(frequencies, log.rate_hz, window, rounded=True)
    else:
        lines = excited_lines(samples[0, stretch], window, log.rate_hz, hann=windows > 1)
    return settings_of(axis, log.rate_hz, lines, hop)


def whole_stretch(signals: NDArray[np.float64], samples_min: int, seams: Sequence[int] = ()) -> slice:
    """The longest stretch of samples that are finite in all signals, shape (signals, samples), and crosses no seam.

    SignalError if it has fewer samples than the minimum.
    """
    finite = np.concatenate([[False], np.isfinite(signals.sum(axis=0)), [False]])
    cut = np.diff(finite)
    cut[[seam for seam in seams if seam < cut.size]] = True
    starts = np.flatnonzero(cut & finite[1:])
    stops = np.flatnonzero(cut & finite[:-1])
    longest = int(np.argmax(stops - starts)) if starts.size else -1
    samples = int(stops[longest] - starts[longest]) if starts.size else 0
    if samples < samples_min:
        raise SignalError(
            "no-clean-samples",
            f"the longest stretch without gaps and samples that are not finite has {samples} samples, less than the "
            f"{samples_min} of one response",
            "choose a shorter window, or check the recording with `livebode inspect`",
            samples=samples,
            samples_min=samples_min,
        )
    return slice(int(starts[longest]), int(stops[longest]))


def suits_lpm(reference: NDArray[np.float64], rate_hz: float) -> bool:
    """Whether the local polynomial method finds a response to this reference at any line.

    Single tones, decaying oscillations and ramps have spectra as smooth as that of a transient.
    """
    try:
        samples = reference[whole_stretch(reference[np.newaxis], WINDOW_MIN)]
        lines = excited_lines(samples, samples.size, rate_hz, hann=False)
    except SignalError:
        return False
    with np.errstate(all="ignore"):
        found = LocalPolynomial(lines, 1, 0, 1.0).process(np.array([samples, samples]), 0)
    return bool(separable(found).any())


def excited_lines(reference: NDArray[np.float64], window: int, rate_hz: float, *, hann: bool) -> Lines:
    """Bins of a window that together have 99.9 % of the reference's power, at most 1,000 of them at equal ratios.

    `reference` is finite. Its power is summed over windows that follow each other, `hann` windows as in Welch's method.
    """
    windows = reference[: reference.size // window * window].reshape(-1, window)
    if hann:
        windows = (windows - windows.mean(axis=1, keepdims=True)) * np.hanning(window + 1)[:-1]
    power = np.sum(np.abs(np.fft.rfft(windows)) ** 2, axis=0)
    power = power[1 : (window + 1) // 2]
    order = np.argsort(power)
    weak = order[np.cumsum(power[order]) <= _POWER * power.sum()]
    bins = np.setdiff1d(np.arange(power.size), weak) + 1
    if not power.any() or not bins.size:
        raise SignalError(
            "line-not-excited",
            "the excitation has no power at any frequency",
            "choose the channel with the signal",
        )
    if bins.size > LINES_MAX:
        targets = np.geomspace(bins[0], bins[-1], LINES_MAX)
        bins = np.unique(bins[np.minimum(np.searchsorted(bins, targets), bins.size - 1)])
    return Lines.of_bins(bins.tolist(), window, rate_hz)
