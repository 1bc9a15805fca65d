"""ModeTracker: from the samples of the outputs to the modes and harmonics of a sliding window."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Block, Emit, Event, ignore
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode_modes.correlations import hop_correlations
from livebode_modes.moving_tone import MovingTone, moving_tone
from livebode_modes.output_only_settings import HOPS_MIN, OutputOnlySettings
from livebode_modes.reduction import PASSED, Reduction
from livebode_modes.refinement import Refinement
from livebode_modes.stabilisation import Mode, possible_modes, stable_modes
from livebode_modes.subspace import Subspace

SPREAD_MAX = 0.25
"""Variance of a harmonic's power over the hops, relative to its mean squared; it is 1 for a mode under noise."""
_DECAYS = 10.0  # a window of so many decay times shows how the amplitude of a mode varies
_SIGMAS = 2.0


def is_harmonic(mode: Mode, y: Floats, rate_hz: float) -> bool:
    """Whether a pole is a harmonic: nearly no damping, and an amplitude that does not vary from hop to hop.

    The amplitude of a mode under noise is that of a Gaussian signal, and a decay's falls; that of a harmonic is
    constant. It is the test by the kurtosis of the band-limited output, 3 for a mode and 1.5 for a harmonic (Jacobsen,
    Andersen & Brincker 2007), on the demodulated output.

    Parameters
    ----------
    y
        The outputs in each hop, (hops, outputs, samples).
    """
    omega = 2 * np.pi * mode.frequency_hz
    window_s = y.shape[0] * y.shape[2] / rate_hz
    damping = mode.damping + _SIGMAS * float(np.sqrt(mode.covariance[1, 1]))
    if damping * omega * window_s > _DECAYS:
        return False
    pairs = np.concatenate([y[:-1], y[1:]], axis=2)  # a longer part separates a line better from a mode beside it
    rotating = np.exp(-1j * omega * np.arange(pairs.shape[2]) / rate_hz) * np.hanning(pairs.shape[2])
    power = np.abs(pairs @ rotating) ** 2
    spread = power.var(axis=0) / power.mean(axis=0) ** 2
    return bool(spread[int(np.argmax(power.mean(axis=0)))] <= SPREAD_MAX)


def _is_new(mode: Mode, stable: list[Mode]) -> bool:
    """Whether no stable pole is within half the half-power width of the mode."""
    apart_hz = [abs(mode.frequency_hz - other.frequency_hz) for other in stable]
    return all(hz > max(mode.damping, _SAME) * mode.frequency_hz for hz in apart_hz)


_FURTHER_ORDERS = 4  # above the sufficient one, for modes that it does not separate
_SAME = 0.01
_PLAUSIBLE_MAX = 1e100  # products of larger samples overflow


@dataclass(frozen=True, eq=False)
class WindowModes:
    """Result of one window.

    Attributes
    ----------
    sample, time_s, schedule
        Newest sample, centre of the window, schedule at that time.
    modes, harmonics
        By frequency.
    status
        "ok", or "gaps" if too many of the window's hops are incomplete.
    order
        Order of the model.
    tone
        The moving tone that has most of the power, with which there are no modes.
    """

    sample: int
    time_s: float
    schedule: float
    modes: tuple[Mode, ...]
    harmonics: tuple[Mode, ...]
    status: str = "ok"
    order: int = 0
    tone: MovingTone | None = None


class ModeTracker:
    """Identifies the modes of a sliding window from the outputs alone, in bounded memory.

    The result does not depend on how the samples are divided into Blocks.

    Parameters
    ----------
    settings
        Outputs, band and window.

    Attributes
    ----------
    counts
        Numbers of samples, gaps, missing samples and samples that are not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> force = np.random.default_rng(1).standard_normal(4000)
    >>> pole = np.exp((-0.02 + 1j) * 2 * np.pi * 30 / 200)  # 30 Hz, damping 2 %, at 200 Hz
    >>> y = lfilter([1.0], [1.0, -2 * pole.real, abs(pole) ** 2], force)
    >>> tracker = ModeTracker(OutputOnlySettings(("y",), 200.0, (1.0, 80.0), factor=1, hop_samples=150))
    >>> newest = tracker.process(Block([y], ["y"], rate_hz=200.0))[-1]
    >>> [round(mode.frequency_hz) for mode in newest.modes]
    [30]
    """

    _reduced: Floats
    _finite: NDArray[np.bool_]
    _schedule: Floats

    def __init__(self, settings: OutputOnlySettings) -> None:
        self.settings = settings
        self.counts = {"samples": 0, "gaps": 0, "missing": 0, "non-finite": 0}
        self._next = -1
        self._begin(0)

    def process(self, block: Block, emit: Emit = ignore) -> list[WindowModes]:
        """The windows that end in these samples."""
        names = self.settings.outputs
        x = np.array([block[name] for name in names])
        x[np.abs(x) > _PLAUSIBLE_MAX] = np.nan
        schedule = np.full(len(block), np.nan) if self.settings.schedule is None else block[self.settings.schedule]
        self._count(block, x, emit)
        missing = block.start - self._next if self._next >= 0 else 0
        if self._next < 0 or missing > self.settings.window:
            self._begin(block.start)
        elif missing:
            x = np.concatenate([np.full((len(names), missing), np.nan), x], axis=1)
            schedule = np.concatenate([np.full(missing, np.nan), schedule])
        self._next = block.stop
        self._schedule = np.concatenate([self._schedule, schedule])
        y, finite = self._reduction.process(x)
        self._reduced = np.concatenate([self._reduced, y], axis=1)
        self._finite = np.concatenate([self._finite, finite])
        return self._windows(block)

    def _begin(self, first: int) -> None:
        """Begin at this sample, without anything before it."""
        of = self.settings
        self._reduction = Reduction(of.factor, of.highpass_hz / of.reduced_rate_hz)
        self._reduced = np.zeros((len(of.outputs), 0))
        self._finite = np.zeros(0, dtype=np.bool_)
        self._schedule = np.zeros(0)
        self._gain = self._reduction.squared_gain(np.fft.rfftfreq(of.hop_samples * of.hops))
        self._passed_hz = of.highpass_hz, PASSED * of.reduced_rate_hz / 2
        self._hops: deque[tuple[Floats, Floats]] = deque(maxlen=of.hops)
        self._first, self._hop_number, self._dropped = first, 0, 0

    def _count(self, block: Block, x: Floats, emit: Emit) -> None:
        bad = np.flatnonzero(~np.isfinite(x).all(axis=0))
        self.counts["samples"] += len(block)
        self.counts["non-finite"] += bad.size
        if self._next >= 0 and block.start > self._next:
            missing = block.start - self._next
            self.counts["gaps"] += 1
            self.counts["missing"] += missing
            gap = Message("1 sample missing before sample {at_sample}", at_sample=block.start)
            if missing > 1:
                gap = Message(
                    "{missing} samples missing before sample {at_sample}", missing=missing, at_sample=block.start
                )
            _report(emit, "gap", block, block.start, gap)
        if bad.size:
            first = block.start + int(bad[0])
            words = Message("1 sample not finite, from sample {at_sample}", at_sample=first)
            if bad.size > 1:
                words = Message(
                    "{samples} samples not finite, from sample {at_sample}", samples=bad.size, at_sample=first
                )
            _report(emit, "non-finite", block, first, words)

    def _windows(self, block: Block) -> list[WindowModes]:
        of, results = self.settings, list[WindowModes]()
        length = of.hop_samples + of.lags
        while self._reduced.shape[1] >= length:
            y, whole = self._reduced[:, :length], bool(self._finite[:length].all())
            correlations = hop_correlations(y, of.hop_samples, of.lags) if whole else np.zeros(0)
            self._hops.append((correlations, y[:, : of.hop_samples].copy()))
            self._reduced, self._finite = self._reduced[:, of.hop_samples :], self._finite[of.hop_samples :]
            self._hop_number += 1
            if len(self._hops) == of.hops:
                results.append(self._window(block))
        return results

    def _window(self, block: Block) -> WindowModes:
        of = self.settings
        begin = (self._hop_number - of.hops) * of.hop + self._reduction.lead
        newest = self._first + begin + (of.hop_samples * of.hops + of.lags - 1) * of.factor + self._reduction.lead
        centre = begin + of.window // 2
        time_s = block.origin_s + (self._first + centre) / of.rate_hz
        schedule = float(self._schedule_at(centre))
        whole = [(r, y) for r, y in self._hops if r.size]
        if len(whole) < max(HOPS_MIN, of.hops // 2):
            return WindowModes(newest, time_s, schedule, (), (), "gaps")
        correlations = np.array([r for r, _ in whole])
        if not np.all(np.einsum("kii->i", correlations[:, 0]) > 0):  # an output does not change
            return WindowModes(newest, time_s, schedule, (), ())
        samples = np.array([y for _, y in whole])
        if len(whole) == of.hops:
            for output in np.concatenate(list(samples), axis=1):
                if (tone := moving_tone(output, of.reduced_rate_hz, of.band_hz)) is not None:
                    return WindowModes(newest, time_s, schedule, (), (), tone=tone)
        subspace = Subspace(correlations, of.rows, of.reduced_rate_hz)
        modes, harmonics = list[Mode](), list[Mode]()
        order, stable = stable_modes(subspace, of.band_hz)
        for mode in stable:
            (harmonics if is_harmonic(mode, samples, of.reduced_rate_hz) else modes).append(mode)
        every = np.array([y for _, y in self._hops]), np.array([bool(r.size) for r, _ in self._hops])
        lines_hz = [mode.frequency_hz for mode in harmonics]
        refinement = Refinement(of.reduced_rate_hz, self._passed_hz, self._gain, *every, lines_hz)
        others = possible_modes(subspace, order + _FURTHER_ORDERS, of.band_hz) if stable else []
        modes = refinement.modes(modes, [mode for mode in others if _is_new(mode, stable)])
        return WindowModes(newest, time_s, schedule, tuple(modes), tuple(harmonics), order=order)

    def _schedule_at(self, centre: int) -> float:
        """The schedule at a sample; everything before it is dropped."""
        dropped = self._dropped
        value = self._schedule[centre - dropped]
        self._schedule = self._schedule[centre - dropped :]
        self._dropped = centre
        return float(value)


def _report(emit: Emit, kind: str, block: Block, sample: int, message: str) -> None:
    emit(Event(kind, sample, block.origin_s + sample / block.rate_hz, message))
