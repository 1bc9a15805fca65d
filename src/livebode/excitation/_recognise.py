"""Detection of the excitation in a recording, its crest factor and signal-to-noise ratio."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.arrays import Flags, Floats
from livebode.core import Lines, SignalError, UsageError, step_of
from livebode.dataclass import dataclass
from livebode.excitation._extent import extent
from livebode.excitation.blocks import cut, spectra
from livebode.excitation.doubtful import refuse_if_doubtful, with_lines_beside, without_junk
from livebode.excitation.hum import separate_hum
from livebode.excitation.period import find_period
from livebode.excitation.prepare import checked, clipped, filled
from livebode.excitation.significance import FLOOR_DB, GAP_DB, BinClasses, find_lines
from livebode.excitation.slips import Slip, find_slips, realigned
from livebode.excitation.transient import leading, unlike


def snr_db(periods: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Power of each line over the noise of one period, 10·log10(|mean Y|²/var Y) in dB, shape (lines,).

    Parameters
    ----------
    periods
        Spectra of the steady periods at the lines, shape (periods, lines).

    Notes
    -----
    The variance is that between periods, Σ|Y_m − Ȳ|²/(M − 1). The remaining noise of the mean biases the power
    upwards: a line without signal shows −10·log10(M) dB on average. NaN with one period; inf where nothing varies.
    """
    count = len(periods)
    if count < 2:
        return np.full(periods.shape[1], np.nan)
    mean = periods.mean(axis=0)
    variance = np.sum(np.abs(periods - mean) ** 2, axis=0) / (count - 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(10 * np.log10(np.abs(mean) ** 2 / variance))


def peak_and_rms(period: NDArray[np.float64]) -> tuple[float, float]:
    """Largest magnitude and rms of the AC part of one period, shape (samples,); their quotient is the crest factor.

    The offset is ignored: it neither excites nor can be separated from that of the sensor. Between samples the signal
    may have higher peaks (negligible for lines far below the Nyquist frequency).

    >>> peak_and_rms(np.array([4.0, 2.0, 4.0, 2.0]))
    (1.0, 1.0)
    """
    ac = period - period.mean()
    return float(np.max(np.abs(ac))), float(np.sqrt(np.mean(ac**2)))


@dataclass(frozen=True, eq=False)
class Excitation:
    """A periodic excitation found in a recording.

    Attributes
    ----------
    lines
        Excited bins of one period; `quiet` are the bins between the first and the last without excitation and
        distortion.
    amplitude
        Of each line, shape (lines,), unit of the excitation: |X| of a sine of this amplitude.
    distortion
        Bins with significant power that is not the excitation's: harmonics, mains.
    rms, peak
        Of the AC part of the mean steady period, unit of the excitation.
    periods
        Whole periods from `start` on.
    start, stop
        First sample of the periodic part and the sample after its last.
    transient
        Numbers of the leading periods that differ from the steady state beyond its noise, at the excitation or
        at the output. Period 0 begins at `start`.
    outlying
        Numbers of the other periods that differ: spikes, pauses.
    snr_db
        Per line at the output, power of the line over the noise of one period, shape (lines,); None without output.
    slips
        Phase jumps: samples that were dropped or repeated without a gap. All other attributes are those of the
        realigned excitation, whose sample numbers include the missing ones.

    Examples
    --------
    >>> import livebode
    >>> period = livebode.multisine(livebode.Lines.parse("20:140:20", rate_hz=4000, window=400))
    >>> excitation = livebode.recognise(np.tile(period, 5), rate_hz=4000)
    >>> excitation.period, excitation.periods, excitation.transient
    (200, 10, ())
    """

    lines: Lines
    amplitude: Floats
    distortion: tuple[int, ...]
    rms: float
    peak: float
    periods: int
    start: int
    stop: int
    transient: tuple[int, ...]
    outlying: tuple[int, ...]
    snr_db: Floats | None = None
    slips: tuple[Slip, ...] = ()

    @property
    def period(self) -> int:
        """Shortest number of samples after which the excitation repeats; also the recommended window."""
        return self.lines.window

    @property
    def crest_factor(self) -> float:
        """peak/rms."""
        return self.peak / self.rms

    @property
    def steady(self) -> tuple[int, ...]:
        """Numbers of the periods that are neither transient nor outlying."""
        left_out = set(self.transient + self.outlying)
        return tuple(m for m in range(self.periods) if m not in left_out)


def recognise(
    excitation: ArrayLike,
    rate_hz: float,
    output: ArrayLike | None = None,
    *,
    floor_db: float = FLOOR_DB,
    gap_db: float = GAP_DB,
    doubtful: bool = False,
) -> Excitation:
    """The period of an excitation, its lines, crest factor, transient periods, and the SNR at an output.

    Parameters
    ----------
    excitation
        Reference or measured signal, shape (samples,). Samples that are not finite are bridged; their periods
        are outlying.
    rate_hz
        Samples per second.
    output
        Signal to measure the SNR and the transient at, shape (samples,), the same samples. Lines 26 dB below the others
        that are below its noise count as distortion.
    floor_db, gap_db
        Level below the strongest line at which a bin counts as not excited, and step in the amplitudes that separates
        the lines from their distortion; see `find_lines`.
    doubtful
        Whether lines are accepted where another set explains the excitation equally well, because only its period
        matters.

    Raises
    ------
    LivebodeError
        If a channel is empty, constant, not finite or of the wrong length, nothing repeats, less than two periods were
        recorded, no line exceeds the noise, or two sets of lines explain it equally well.

    Examples
    --------
    >>> from livebode.excitation import multisine
    >>> period = multisine(Lines.parse("20:140:20", rate_hz=4000, window=400))
    >>> found = recognise(np.tile(period, 5) + 3.0, rate_hz=4000)
    >>> found.period, found.lines.bins, found.periods
    (200, (1, 2, 3, 4, 5, 6, 7), 10)
    >>> round(found.crest_factor, 2)
    1.9
    """
    given, answer = _checked_together(excitation, rate_hz, output)
    x = filled(given)
    step = step_of(x)
    period, start, stop = find_period(x, rate_hz, step)
    if slips := find_slips(x, period):
        given = realigned(given, slips)
        answer = None if answer is None else realigned(answer, slips)
        x = filled(given)
        period, start, stop = find_period(x, rate_hz, step)
    view = slice(start, stop)
    # Spikes are clipped for the first search of lines, but not for the search of periods with spikes.
    roughly = find_lines(spectra(cut(clipped(x[view]), period)), floor_db, gap_db).excited
    roughly[1:] |= not roughly.any()
    blocks, strange = _periods(given[view], period, roughly)
    replies = None
    if answer is not None:
        replies, also = _periods(answer[view], period, roughly)
        strange = strange | also
    steady = ~strange if np.sum(~strange) >= 2 else np.ones(len(blocks), dtype=np.bool_)
    classes = separate_hum(find_lines(spectra(blocks[steady]), floor_db, gap_db, step), rate_hz / period)
    classes = with_lines_beside(classes, rate_hz / period)
    ratio_db = None if replies is None else snr_db(spectra(replies[steady]))
    if ratio_db is not None:
        classes = without_junk(classes, ratio_db)
    if not doubtful:
        refuse_if_doubtful(classes, period, rate_hz)
    if not classes.excited.any():
        raise _no_line(period, len(blocks))
    peak, rms = peak_and_rms(blocks[steady].mean(axis=0))
    ahead = leading(strange)
    return Excitation(
        lines=_lines(classes, period, rate_hz),
        amplitude=classes.amplitude[classes.excited],
        distortion=_numbers(classes.distortion),
        rms=rms,
        peak=peak,
        periods=len(blocks),
        start=start,
        stop=stop,
        transient=tuple(range(ahead)),
        outlying=tuple(m for m in _numbers(strange) if m >= ahead),
        slips=slips,
        snr_db=None if ratio_db is None else ratio_db[classes.excited],
    )


def lines_of_window(excitation: ArrayLike, window: int, rate_hz: float) -> Lines:
    """The lines of an excitation in windows of a given length, where a person knows better than `recognise`.

    Parameters
    ----------
    excitation
        Reference or measured signal, shape (samples,).
    window
        Length of the window, samples; a multiple of the excitation's period.
    rate_hz
        Samples per second.

    Raises
    ------
    LivebodeError
        If the channel is empty, constant or not finite, has less than two windows, or no line exceeds what differs
        between the windows.

    Examples
    --------
    >>> from livebode.excitation import multisine
    >>> period = multisine(Lines.parse("20:140:20", rate_hz=4000, window=200))
    >>> lines_of_window(np.tile(period, 8), 400, 4000).bins
    (2, 4, 6, 8, 10, 12, 14)
    """
    x = filled(checked(excitation, "excitation"))
    if x.size < 2 * window:
        raise SignalError(
            "too-short",
            f"the recording has {x.size} samples, less than two windows of {window} to find the lines in",
            f"set lines.frequencies, or a window of at most {x.size // 2} samples",
            samples=int(x.size),
            window=window,
        )
    start, stop = extent(clipped(x), window)
    classes = find_lines(spectra(cut(clipped(x[start:stop]), window)), step=step_of(x))
    if not classes.excited.any():
        raise _no_line(window, x.size // window)
    return _lines(classes, window, rate_hz)


def _no_line(period: int, periods: int) -> SignalError:
    return SignalError(
        "no-line-above-noise",
        f"no line of the period of {period} samples exceeds the noise of {periods} periods",
        "record more periods, or raise the amplitude",
        period=period,
        periods=periods,
    )


def _checked_together(excitation: ArrayLike, rate_hz: float, output: ArrayLike | None) -> tuple[Floats, Floats | None]:
    given = checked(excitation, "excitation")
    if not (isinstance(rate_hz, (int, float, np.number)) and np.isfinite(rate_hz) and rate_hz > 0):
        raise UsageError(
            "out-of-range",
            f"{rate_hz=} is not a positive number of samples per second",
            "specify the samples per second",
            argument="rate_hz",
            value=rate_hz,
        )
    if output is None:
        return given, None
    answer = checked(output, "output")
    if answer.size != given.size:
        raise UsageError(
            "wrong-shape",
            f"the output has {answer.size} samples and the excitation {given.size}",
            "use the same part of both",
            argument="output",
            samples=int(answer.size),
            excitation_samples=int(given.size),
        )
    return given, answer


def _periods(samples: Floats, period: int, lines: Flags) -> tuple[Floats, Flags]:
    """The periods without drift, and which of them differ from the others or have missing samples."""
    blocks = cut(filled(samples), period)
    missing = np.isnan(samples[: blocks.size].reshape(blocks.shape)).any(axis=1)
    strange: Flags = np.array(missing)
    # Bridged samples are not compared, so that they do not count as usual.
    whole = blocks[~missing]
    strange[~missing] = unlike(whole, lines)
    return blocks, strange


def _lines(classes: BinClasses, period: int, rate_hz: float) -> Lines:
    bins = _numbers(classes.excited)
    taken = classes.excited | classes.distortion
    quiet = tuple(k for k in range(bins[0], bins[-1]) if not taken[k])
    return Lines(bins, period, rate_hz, quiet)


def _numbers(flags: Flags) -> tuple[int, ...]:
    return tuple(int(k) for k in np.flatnonzero(flags))
