"""Speed, acceleration and input of an axis, all smoothed by the same kernel."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Block, SignalError, UsageError
from livebode.dataclass import dataclass

OutputKind = Literal["position", "velocity"]

_HALF_POWER = np.sqrt(np.log(2)) / (2 * np.pi)  # σ of a Gaussian times the frequency at which its power is a half
_REACH = 6.0  # σ on each side, beyond which a kernel is zero: at 4 its second moment lacks 0.5 %
_LAGS = 6  # beyond, smoothed white noise is correlated by less than 1e-3
_SHARPER = 5.0  # times the band: the speed whose sign decides about dry friction
_SLOWEST = 0.01  # of the highest speed
_FINE = 8  # samples of the sharp speed in σ
_ROUNDED = 2  # samples by which the reach of the kernel differs between two rates
_SAMPLES_MIN = 2.0  # σ in samples: below it the sampled derivative of the kernel is wrong
_SHARPEST = 2.01  # the same with a margin for rounding
_KEPT = 0.2  # of an amplitude, that the sharpest kernel must leave


@dataclass(frozen=True, eq=False)
class SmoothKernel:
    """A Gaussian without delay, and its derivatives.

    Convolved with the k-th derivative of a kernel, a position gives the k-th derivative of the smoothed position. So
    all terms of an equation of motion pass through one filter, which needs no derivative of a measured signal
    (Gautier, Janot and Vandanjon, IEEE Trans. Control Systems Technology 21(2), 2013, use a decimating filter to the
    same end).

    Parameters
    ----------
    band_hz
        Frequency at which its power is a half.
    rate_hz
        Of the samples.
    """

    band_hz: float
    rate_hz: float

    @classmethod
    def sharpest(cls, rate_hz: float) -> SmoothKernel:
        """With the highest band at this rate."""
        return cls(float(_HALF_POWER * rate_hz / _SHARPEST), rate_hz)

    @property
    def most_hz(self) -> float:
        """Frequency at which the kernel leaves a fifth of an amplitude."""
        return float(np.sqrt(-2 * np.log(_KEPT)) * self.rate_hz / (2 * np.pi * self.sigma))

    def left(self, frequency_hz: Floats) -> Floats:
        """What the kernel leaves of an amplitude."""
        return np.asarray(np.exp(-0.5 * (2 * np.pi * frequency_hz * self.sigma / self.rate_hz) ** 2))

    @property
    def sigma(self) -> float:
        """Standard deviation, in samples."""
        return float(_HALF_POWER * self.rate_hz / self.band_hz)

    @property
    def reach(self) -> int:
        """Samples on each side on which a smoothed value depends."""
        return int(np.ceil(_REACH * self.sigma))

    @property
    def fine_step(self) -> int:
        """Samples between those of a speed that is sharper than the kernel."""
        return max(round(self.sigma / _FINE), 1)

    @property
    def step(self) -> int:
        """Samples between those that a regression uses, about σ."""
        return self.fine_step * round(self.sigma / self.fine_step)

    @property
    def correlation(self) -> Floats:
        """Correlation of smoothed white noise at lags of 0, 1, … steps, shape (lags,)."""
        return np.asarray(np.exp(-((np.arange(_LAGS) * self.step / self.sigma) ** 2) / 4))

    def smooth(self, signal: Floats, derivative: int = 0) -> Floats:
        """The smoothed signal or a derivative of it per second, at the samples that have `reach` ones on both sides."""
        distance = np.arange(-self.reach, self.reach + 1) / self.sigma
        kernel = np.exp(-0.5 * distance**2)
        kernel /= kernel.sum()
        scale = self.rate_hz / self.sigma
        if derivative == 1:
            kernel = -distance * kernel * scale
        elif derivative == 2:
            kernel = (distance**2 - 1) * kernel * scale**2
            kernel -= kernel.mean()  # what the cut ends leave: a constant has no derivative
        size = 1 << int(np.ceil(np.log2(signal.size + kernel.size)))
        product = np.fft.rfft(signal - signal[0], size) * np.fft.rfft(kernel, size)
        inner = np.fft.irfft(product, size)[2 * self.reach : signal.size]
        return np.asarray(inner + (signal[0] if derivative == 0 else 0.0))


def applied(input: Floats) -> Floats:
    """The input around each sample, (samples,): a logged input acts from its sample to the next one."""
    return np.asarray((input + np.concatenate([input[:1], input[:-1]])) / 2)


@dataclass(frozen=True, eq=False)
class SmoothMotion:
    """Samples of an axis for a regression, shape (samples,) each, a kernel's width apart.

    Attributes
    ----------
    input, velocity, acceleration
        Smoothed, in SI units and per second.
    position
        Where the axis is, from the recording or the integral of its velocity.
    sign
        Smoothed sign of the speed.
    sharp
        Speed with less smoothing, at `fine_step` of the kernel, from before the first sample to after the last one.
    standing
        Share of the kernel in which the axis is at standstill: slower than `slowest` for more than its width.
    kernel
        The filter.
    """

    input: Floats
    position: Floats
    velocity: Floats
    acceleration: Floats
    sign: Floats
    sharp: Floats
    standing: Floats
    kernel: SmoothKernel

    @classmethod
    def of(
        cls, block: Block, input: str, output: str, kind: OutputKind, band_hz: float, slowest: float | None
    ) -> SmoothMotion:
        """From samples without gaps; `slowest` is by default 1 % of the highest speed.

        Raises
        ------
        SignalError
            If there are fewer samples than the kernel needs, or it is shorter than two of them.
        UsageError
            If the band is not a positive number.
        """
        if not 0 < band_hz < np.inf:
            raise UsageError(
                "out-of-range", f"{band_hz=} is out of its range", "choose a positive number", argument="band_hz",
                value=band_hz,
            )  # fmt: skip
        kernel = SmoothKernel(band_hz, block.rate_hz)
        if kernel.sigma < _SAMPLES_MIN:
            most = _HALF_POWER * block.rate_hz / _SAMPLES_MIN
            raise SignalError(
                "rate-differs",
                f"a band of {band_hz:g} Hz needs more samples than {block.rate_hz:g} a second",
                f"choose a band of at most {most:.3g} Hz",
                band_hz=band_hz,
                rate_hz=block.rate_hz,
            )
        if len(block) < 10 * kernel.reach:
            raise SignalError(
                "too-short",
                f"{len(block)} samples are less than {10 * kernel.reach}, which a band of {band_hz:g} Hz needs",
                "record some strokes, or choose a higher band",
                samples=len(block),
                limit=10 * kernel.reach,
            )
        order = 0 if kind == "velocity" else 1
        y = block[output]
        speed = _sharp_speed(y, kernel, order)
        inner = slice(kernel.reach, len(block) - kernel.reach)
        least = _SLOWEST * float(np.max(np.abs(speed))) if slowest is None else slowest
        way = y if kind == "position" else np.cumsum(y) / block.rate_hz
        step = slice(None, None, kernel.step)
        return cls(
            input=kernel.smooth(block[input])[step],
            position=way[inner][step],
            velocity=kernel.smooth(y, order)[step],
            acceleration=kernel.smooth(y, order + 1)[step],
            sign=kernel.smooth(np.sign(speed))[step],
            sharp=speed[kernel.reach % kernel.fine_step :: kernel.fine_step],
            standing=kernel.smooth(_held(np.abs(speed) <= least, 2 * kernel.sigma))[step],
            kernel=kernel,
        )

    def smoothed(self, value: Floats) -> Floats:
        """A continuous function of `sharp`, through the same kernel: the mean of a curve is not the curve at the mean.

        Shape (sharp samples,) to (samples,).
        """
        fine_step = self.kernel.fine_step
        kernel = SmoothKernel(self.kernel.band_hz, self.kernel.rate_hz / fine_step)
        first = self.kernel.reach // fine_step - kernel.reach + _ROUNDED
        inner = kernel.smooth(np.pad(value, _ROUNDED, mode="edge"))
        return np.asarray(inner[first :: self.kernel.step // fine_step][: self.input.size])


def _sharp_speed(y: Floats, kernel: SmoothKernel, order: int) -> Floats:
    """Speed with less smoothing, at every sample; at the ends that of the first and last one known."""
    sharp = SmoothKernel(kernel.band_hz * min(_SHARPER, kernel.sigma / _SAMPLES_MIN), kernel.rate_hz)
    return np.pad(sharp.smooth(y, order), sharp.reach, mode="edge")


def _held(slow: NDArray[np.bool_], samples: float) -> Floats:
    """1 where a stretch of slow samples is longer than that, else 0: a reversal is short, a standstill is not."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], slow, [False]])))
    held = np.zeros(slow.size)
    for first, stop in zip(edges[::2], edges[1::2]):
        if stop - first > samples:
            held[first:stop] = 1.0
    return held
