"""Evidence of a change from samples and a baseline's model, without a fit, at any speed and in any direction."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Lines
from livebode.monitoring import evidence as word
from livebode.monitoring.amplitude import STRONGER
from livebode.monitoring.covariates import window_means
from livebode.monitoring.evidence import Evidence
from livebode.monitoring.machine import LearnedMachine
from livebode.monitoring.ripple import allowed_for
from livebode.monitoring.sensitivity import DIRECTIONS, Offset, Replay
from livebode.monitoring.stretches import LEAD_S, WindowStretch
from livebode.motion import shaft_position, without_drift

SIGNALS = 3
"""Torque, velocity, position; the covariates follow them."""
_UNEVEN = 0.1  # of a window's travel, against the window before it
_SPEED_MARGIN = 0.1
_OWN = len(DIRECTIONS)
_LEVEL_MEMORY = 0.9  # per window, of the noise's level
_LEVEL_RISE_MAX = 4.0
_UNINFORMED = 1e-6  # of the information for a smallest change at one standard deviation: no run is long enough for that
_STATUS = f"<U{len(word.NO_COVARIATE)}"  # the longest one
_SWING, _SWING_MARGIN = 0.2, 1.1  # of the speed: a multisine's peak is up to four times its root mean square
_DISTURBED = 20.0  # the mean of six detection lines exceeds its own level by this factor once in 1e40 windows


class ModelEvidence:
    """Stretches in, Evidence out: the residual of the baseline's model, window by window.

    The model is driven by the measured torque along the measured positions. E is the spectrum of the measured velocity
    less the model's, Ψ that of the model's slope by the logarithm of Keff, mL, bs, Js, each at the lines; then with the
    noise's power P at a line

        score = Σ 2·Re(Ψ*·E)/P,    information = Σ 2·Re(Ψ*·Ψ)/P.

    Without a change E is the sensor's noise alone, so windows that do not overlap are independent. P is the
    baseline's, or higher in proportion to the noise at the detection lines.

    With an Offset, E is the residual of the model with this offset. A ripple of the Machine is allowed for at any
    phase (see `ripple.allowed_for`). An influence of the covariates is not a change: the model follows their mean over
    the stretch, and the windows' own values are included to first order.
    """

    def __init__(self, machine: LearnedMachine, lines: Lines) -> None:
        self._machine, self._lines = machine, lines
        self._replay = Replay(machine.model, lines.rate_hz, machine.delay_s)
        self.level = 1.0
        """Ratio of the noise to the learned one, at least 1."""

    def process(self, stretch: WindowStretch, offset: Offset) -> Evidence:
        """Evidence of every window of the stretch, in order."""
        lines, machine = self._lines, self._machine
        bad = missing(stretch.data[:SIGNALS])
        u, y, x = held(stretch.data[:SIGNALS], bad)
        begin = np.arange(stretch.first, stretch.last) * lines.window - stretch.start
        covariate = window_means(stretch.data[SIGNALS:], begin, lines.window)
        offset, rest_of_shift = self._shifted(offset, covariate)
        velocity, slopes = self._replay(u, x, offset)
        residual = y - without_drift(velocity, y, lines.window)
        windows = slice(begin[0], begin[-1] + lines.window)
        unexplained = residual[windows].reshape(-1, lines.window) @ wave((*lines.bins, *lines.quiet), lines.window)
        slopes = _without_drift(slopes, lines.window)
        slope = slopes[:, windows].reshape(len(slopes), -1, lines.window) @ wave(lines.bins, lines.window)
        power = unexplained.real**2 + unexplained.imag**2
        quiet = power[:, len(lines) :]
        centre, speed, status = self._way(x, begin, stretch, bad, covariate)
        level = self._levels(quiet, status)
        amplitude = _rms(u[windows], lines)
        mean = y[windows].reshape(-1, lines.window).mean(axis=1)
        swing = np.linalg.norm(_rms(y[windows], lines), axis=1) / np.maximum(np.abs(mean), np.finfo(float).tiny)
        excess = machine.amplitude.excess(amplitude)
        reverses = (excess > STRONGER) & (swing > _SWING_MARGIN * max(machine.swing, _SWING))
        status[(status == word.JUDGED) & reverses] = word.AMPLITUDE
        # What the model omits grows with the excitation: it is known only relative to the learned amplitude.
        level = level * excess**2
        weight = 2 / (machine.noise_power * level[:, np.newaxis])
        e = unexplained[:, : len(lines)]
        conjugate = slope.conj()
        score = np.einsum("jwl,wl,wl->wj", conjugate, e, weight).real
        information = np.einsum("jwl,kwl,wl->wjk", conjugate, slope, weight).real
        ripple = self._ripple(x, y, windows)
        ripple_score = np.einsum("owl,wl,wl->wo", ripple.conj(), e, weight).real
        gram = np.einsum("owl,pwl,wl->wop", ripple.conj(), ripple, weight).real
        if len(ripple):
            cross = np.einsum("jwl,owl,wl->wjo", conjugate, ripple, weight).real
            score, information = allowed_for(score, information, ripple_score, cross, gram, machine.ripple.spread)
        score = score - np.einsum("wjk,wk->wj", information[:, :, :_OWN], rest_of_shift)
        in_smallest = np.einsum("wjj->wj", information[:, :_OWN, :_OWN]) * machine.held.smallest**2
        status[(status == word.JUDGED) & (in_smallest.max(axis=1) < _UNINFORMED)] = word.UNEXCITED
        return Evidence(
            score=score[:, :_OWN],
            information=information[:, :_OWN, :_OWN],
            late_score=score[:, _OWN],
            late_information=information[:, _OWN],
            power=power[:, : len(lines)],
            quiet_power=quiet,
            position_m=centre,
            speed_m_per_s=speed,
            time_s=np.asarray(stretch.origin_s + (stretch.start + begin + (lines.window - 1) / 2) / lines.rate_hz),
            sample=stretch.start + begin + lines.window - 1,
            status=status,
            ripple_score=ripple_score,
            ripple_information=gram,
            ripple_gain=(np.abs(ripple[0::2]) ** 2 + np.abs(ripple[1::2]) ** 2).swapaxes(0, 1),
            covariate=covariate,
            amplitude=amplitude,
            swing=swing,
        )

    def _shifted(self, offset: Offset, covariate: Floats) -> tuple[Offset, Floats]:
        """The offset with the mean influence of the covariates, and its difference in each window, (windows, 4)."""
        covariates = self._machine.covariates
        if not len(covariates):
            return offset, np.zeros((len(covariate), _OWN))
        known = covariates.known(covariate)[:, np.newaxis]
        shift = np.where(known, covariates.shift(np.where(known, covariate, covariates.mean)), 0.0)
        common = shift.sum(axis=0) / max(np.count_nonzero(known), 1)
        return replace(offset, logarithms=offset.logarithms + common), np.where(known, shift - common, 0.0)

    def way(self, stretch: WindowStretch) -> tuple[Floats, Floats, NDArray[np.str_]]:
        """Position, speed and status of every window, without the check for disturbances by the noise."""
        bad = missing(stretch.data[:SIGNALS])
        begin = np.arange(stretch.first, stretch.last) * self._lines.window - stretch.start
        covariate = window_means(stretch.data[SIGNALS:], begin, self._lines.window)
        return self._way(held(stretch.data[:SIGNALS], bad)[2], begin, stretch, bad, covariate)

    def residual(self, stretch: WindowStretch, offset: Offset) -> Floats:
        """Rows over the samples, (2 + 2·orders, samples).

        The measured velocity less the model's, without slow drift; the velocity by cosine and sine of each order of 1
        N m; and the shaft's position.
        """
        u, y, x = held(stretch.data[:SIGNALS], missing(stretch.data[:SIGNALS]))
        begin = np.arange(stretch.first, stretch.last) * self._lines.window - stretch.start
        offset, _ = self._shifted(offset, window_means(stretch.data[SIGNALS:], begin, self._lines.window))
        difference = y - without_drift(self._replay.plain(u, x, offset), y, self._lines.window)
        shaft_m = shaft_position(x, y, self._lines.window, self._lines.rate_hz)
        return np.vstack([difference, self._driven(x, shaft_m), shaft_m])

    def _driven(self, x: Floats, shaft_m: Floats) -> Floats:
        """Velocity by cosine and sine of each order of 1 N m, without drift, (2·orders, samples)."""
        if not len(self._machine.ripple):
            return np.zeros((0, x.size))
        velocity = self._replay.ripple(self._machine.ripple.cycles_per_m, x, shaft_m)
        return _without_drift(velocity, self._lines.window)

    def _ripple(self, x: Floats, y: Floats, windows: slice) -> NDArray[np.complex128]:
        """Spectrum at the lines of the velocity by each order of 1 N m, without drift, (2·orders, windows, lines)."""
        window, transform = self._lines.window, wave(self._lines.bins, self._lines.window)
        if not len(self._machine.ripple):
            return np.zeros((0, (windows.stop - windows.start) // window, len(self._lines)), dtype=np.complex128)
        shaft_m = shaft_position(x, y, window, self._lines.rate_hz)
        velocity = self._driven(x, shaft_m)
        return np.asarray(velocity[:, windows].reshape(len(velocity), -1, window) @ transform)

    def _way(
        self, x: Floats, begin: NDArray[np.int64], stretch: WindowStretch, bad: NDArray[np.bool_], covariate: Floats
    ) -> tuple[Floats, Floats, NDArray[np.str_]]:
        """Position and speed at the windows' centres, and which windows are judged."""
        window, machine = self._lines.window, self._machine
        centre, speed, even = way(x, begin, window, self._lines.rate_hz)
        since = begin + stretch.start - stretch.settled < 0
        if bad.any():
            count = np.concatenate([[0], np.cumsum(bad)])
            since |= count[begin + window] > count[(begin - round(LEAD_S * self._lines.rate_hz)).clip(0)]
        reasons = {
            word.DISTURBED: since,
            word.SLOW: np.abs(speed) < (1 - _SPEED_MARGIN) * machine.slowest_m_per_s,
            word.UNEVEN: ~even,
            word.FAST: np.abs(speed) > (1 + _SPEED_MARGIN) * machine.fastest_m_per_s,
            word.PLACE: ~machine.known(centre),
            word.NO_COVARIATE: ~np.isfinite(covariate).all(axis=1),
            word.COVARIATE: ~machine.covariates.known(covariate),
        }
        status = np.full(len(begin), word.JUDGED, dtype=_STATUS)
        for reason, here in reversed(reasons.items()):  # the first that applies remains
            status[here] = reason
        return centre, speed, status

    def _levels(self, quiet: Floats, status: NDArray[np.str_]) -> Floats:
        """Ratio of the noise to the learned one at each window, at least 1; marks disturbed windows."""
        levels = np.ones(len(quiet))
        if not quiet.size:
            return levels
        now = np.mean(quiet / self._machine.quiet_power, axis=1)
        for i in np.flatnonzero(status == word.JUDGED):
            if now[i] > _DISTURBED * self.level:
                status[i] = word.DISTURBED
            rise = min(now[i], _LEVEL_RISE_MAX * self.level)
            self.level = max(1.0, _LEVEL_MEMORY * self.level + (1 - _LEVEL_MEMORY) * rise)
            levels[i] = max(self.level, now[i])
        return levels


def _rms(samples: Floats, lines: Lines) -> Floats:
    """Root mean square of each window at each line, (windows, lines)."""
    spectrum = samples.reshape(-1, lines.window) @ wave(lines.bins, lines.window)
    return np.asarray(np.sqrt(2) / lines.window * np.abs(spectrum))


def _without_drift(velocities: Floats, window: int) -> Floats:
    """What remains of each in the residual, from which slow drift is removed, (rows, samples)."""
    still = np.zeros(velocities.shape[1])
    return np.array([without_drift(velocity, still, window) for velocity in velocities])


def missing(data: Floats) -> NDArray[np.bool_]:
    """Where a sample of any signal is not finite, shape (samples,)."""
    return np.asarray(~np.isfinite(data).all(axis=0))


def held(data: Floats, bad: NDArray[np.bool_]) -> Floats:
    """Replace a non-finite sample by the previous finite one, or by zero."""
    if not bad.any():
        return data
    last = np.maximum.accumulate(np.where(bad, -1, np.arange(bad.size)))
    return np.where(last >= 0, data[:, last.clip(0)], 0.0)


@lru_cache(maxsize=8)  # every axis of a process has the same few
def wave(bins: tuple[int, ...], window: int) -> NDArray[np.complex128]:
    """From a window's samples to its spectrum at these bins, shape (window, bins); not writable."""
    matrix = np.asarray(np.exp(-2j * np.pi * np.outer(np.arange(window), bins) / window))
    matrix.flags.writeable = False
    return matrix


def way(x: Floats, begin: NDArray[np.int64], window: int, rate_hz: float) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Position and speed at the centre of the windows that begin there, and whether the speed is steady.

    A window is steady together with the previous one. Where the speed changes, friction changes, which the model omits.
    """
    here, there, before = x[begin], x[begin + window - 1], x[(begin - window + 1).clip(0)]
    travel = there - here
    even = (begin >= window - 1) & (np.abs(travel - (here - before)) <= _UNEVEN * np.abs(travel))
    return (here + there) / 2, travel * rate_hz / (window - 1), even
