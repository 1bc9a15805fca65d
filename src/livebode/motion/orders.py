"""Orders: torque that repeats with the motor's angle, such as cogging, found in a model's residual of usual strokes.

A RippleWatch finds them while the axis works, with their size and their effect on the bounds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Lines, Stage, StatefulBase, log_sum_exceeded
from livebode.estimation import RippleOrder, RippleSpeed, Settings, ripple_power
from livebode.motion.chunk import Chunk, steady_rows
from livebode.motion.fit import sampled
from livebode.motion.model import MovingModel
from livebode.motion.replay import without_drift

_PADDED = 2  # travels: length of the transform over the position
_FINE = 2.5  # samples of the position in the shortest cycle that is looked for
_FROM = 0.25  # of a bin, Hz: slower drift is removed
_BEYOND = 2  # bins above the highest line, whose orders still leak into it
_FLOOR = 32  # widths of a peak, over which the noise is taken as constant
_MASKED = 4.5  # widths of a peak, beside a line: the model's error may be there
_PEAK = 2.0  # widths of a peak on each side, which have its power though its order is known to half of one
_CAP = 12.0  # of a stroke's power over its noise: a single stroke does not make an order
_STROKES_MIN = 5
_FALSE = 1e-4  # probability of a false order
_APART = 8.0  # travels: peaks closer than this are one order
_MOST = 8


def shaft_position(position_m: Floats, velocity: Floats, window: int, rate_hz: float) -> Floats:
    """Position of the motor's shaft, as metres of belt: the slow part from the position, the fast one from the
    velocity.

    The excitation swings the shaft by a hundredth of a radian, which is a quarter of a radian of an order of 24 a turn;
    a measured position may be that of the cart, or too coarse to resolve it.

    Parameters
    ----------
    position_m, velocity
        Of the schedule, and of the motor, rad/s, shape (samples,) each; at least a window.
    """
    angle = (np.cumsum(velocity) - velocity / 2) / rate_hz
    ends = np.arange(0, position_m.size, window)
    travel, turned = np.diff(position_m[ends]), np.diff(angle[ends])
    total = float(turned @ turned)
    radius_m = float(travel @ turned) / total if total > 0 else 0.0
    return without_drift(radius_m * angle, position_m, window)


class OrderSpectrum(StatefulBase):
    """Power spectrum of a residual over the position, in cycles a metre, mean over steady strokes.

    Over time a ripple's frequency follows the speed; over the position it is constant. Each stroke is averaged onto an
    even grid of positions (boxcar) and weighted with a Blackman–Harris window. Its power is divided by the noise around
    (median over 32 widths of a peak), so that without a ripple it is exponentially distributed with mean 1. Around the
    excitation's lines a stroke is not used: there the model may be incomplete, at a place that moves with the speed.
    The sum over strokes is Gamma distributed. An order is a peak whose probability by chance, times the places
    searched, is below 1e-4.

    Bias: a ripple whose order meets a line in every stroke is not found, because the machine's response and the ripple
    cannot then be separated by any method. Strokes at two speeds separate them.

    Parameters
    ----------
    lines
        Of the excitation; orders that are always two bins above the highest one are not searched.
    way_m
        From the lowest to the highest position.
    slowest_m_per_s
        Speed of the slowest stroke.
    """

    _stage = Stage("order-spectrum", 1)
    _STATE = ("_sum", "_whole", "_torque", "_count")

    def __init__(self, lines: Lines, way_m: float, slowest_m_per_s: float) -> None:
        self._lines_hz = lines.frequency_hz
        bin_hz = lines.rate_hz / lines.window
        self._least_hz, self._most_hz = _FROM * bin_hz, float(self._lines_hz[-1]) + _BEYOND * bin_hz
        self._rate_hz = lines.rate_hz
        required_m = slowest_m_per_s / (_FINE * self._most_hz)
        self._points = 1 << max(int(np.ceil(np.log2(_PADDED * way_m / required_m))), 1)
        self._step_m = _PADDED * way_m / self._points
        self.cycles_per_m = np.arange(self._points // 2 + 1) / (_PADDED * way_m)
        self._sum, self._whole, self._torque = np.zeros((3, self.cycles_per_m.size))
        self._count = np.zeros(self.cycles_per_m.size, dtype=np.int64)

    def add(self, residual: Floats, position_m: Floats, gain: Callable[[Floats], Floats] | None = None) -> None:
        """Process a steady stroke: residual of the model and position, shape (samples,) each.

        `gain` gives |G| at frequencies in Hz; with it the torque of each order is also known (`amplitudes`).
        """
        if (stroke := self._stroke(residual, position_m)) is None:
            return
        power, noise, use, frequency_hz, window = stroke
        ratio = power[use] / noise[use]
        self._sum[use] += np.minimum(ratio, _CAP)
        self._whole[use] += ratio
        self._count += use
        if gain is not None:
            # Of a tone of amplitude a, windowed by w and averaged over steps, the power is (a·Σw/2·sinc)².
            whole = window.sum() / 2 * np.sinc(self.cycles_per_m[use] * self._step_m)
            self._torque[use] += np.maximum(power[use] - noise[use], 0.0) / (whole * gain(frequency_hz[use])) ** 2

    def explained(self, residual: Floats, driven: Floats, position_m: Floats, orders: Floats) -> Floats:
        """Evidence of a stroke for the squared amplitude of orders of this spectrum, (2, orders), to be summed.

        With the power P of the residual around an order, N of the noise, and H of the velocity that 1 N m of the order
        gives: H·(P − N)/N² and H²/N². The ratio of their sums is the squared amplitude, by least squares. Zero where
        the order is beside a line.

        Parameters
        ----------
        residual, position_m
            As for `add`.
        driven
            Velocity by cosine and sine of each order, 1 N m, rad/s, (2·orders, samples).
        """
        if (stroke := self._stroke(residual, position_m)) is None:
            return np.zeros((2, orders.size))
        power, noise, use, _, window = stroke
        beside = round(_PEAK * self._points / window.size)
        around = np.searchsorted(self.cycles_per_m, orders)[:, np.newaxis] + np.arange(-beside, beside + 1)
        around = around.clip(0, power.size - 1)
        each = np.array([self._power(row, position_m, window) for row in driven])
        gain = (each[0::2] + each[1::2])[np.arange(orders.size)[:, np.newaxis], around].sum(axis=1) / 2
        known, floor = use[around].all(axis=1), noise[around].sum(axis=1)
        floor = np.where(known, floor, 1.0)
        above = power[around].sum(axis=1) - floor
        return np.asarray(np.where(known, [gain * above / floor**2, (gain / floor) ** 2], 0.0))

    def _stroke(
        self, residual: Floats, position_m: Floats
    ) -> tuple[Floats, Floats, NDArray[np.bool_], Floats, Floats] | None:
        """Power, noise, the orders to use, their frequencies, and the window; None of a stroke that is too short."""
        samples = _over_position(residual, position_m, self._step_m).size
        width = self._points / max(samples, 1)
        if samples < _FLOOR or width > self.cycles_per_m.size / _FLOOR:
            return None
        window = _blackman_harris(samples)
        power = self._power(residual, position_m, window)
        block = round(_FLOOR * width)
        blocks = power[: power.size // block * block].reshape(-1, block)
        noise = np.interp(
            np.arange(power.size), (np.arange(len(blocks)) + 0.5) * block, np.median(blocks, axis=1) / np.log(2)
        )
        speed = abs(position_m[-1] - position_m[0]) * self._rate_hz / (position_m.size - 1)
        frequency_hz = self.cycles_per_m * speed
        use = (frequency_hz > self._least_hz) & (frequency_hz < self._most_hz) & (noise > 0)
        beside = np.abs(frequency_hz[:, np.newaxis] - self._lines_hz).min(axis=1)
        use &= beside > _MASKED * width * self.cycles_per_m[1] * speed
        return power, noise, use, frequency_hz, window

    def _power(self, velocity: Floats, position_m: Floats, window: Floats) -> Floats:
        """Power over the orders of a velocity along a stroke."""
        even = _over_position(velocity, position_m, self._step_m)
        return np.asarray(np.abs(np.fft.rfft((even - even.mean()) * window, self._points)) ** 2)

    def amplitudes(self, orders: Floats) -> Floats:
        """Root mean square over the strokes of each order's amplitude, N m, (orders,)."""
        index = np.searchsorted(self.cycles_per_m, orders)
        return np.asarray(np.sqrt(self._torque[index] / np.maximum(self._count[index], 1)))

    def found(self) -> Floats:
        """Orders in cycles a metre, the strongest first, at most eight."""
        enough = self._count >= _STROKES_MIN
        if not enough.any():
            return np.zeros(0)
        strength = np.where(enough, self._whole / np.maximum(self._count, 1), 0.0)
        mean = np.where(enough, self._sum / np.maximum(self._count, 1), 1.0)
        limit = np.log(_FALSE / max(np.count_nonzero(enough) / _PADDED, 1))
        left = enough & (log_sum_exceeded(self._count, self._sum) < limit)
        # Components that move with the speed, such as an eccentric pulley's sidebands, raise whole ranges.
        around = np.maximum(_medians(mean, _FLOOR * _PADDED, left), 1.0)
        left[left] = log_sum_exceeded(self._count[left], self._sum[left] / around) < limit
        orders, apart = list[float](), round(_APART * _PADDED)
        while left.any() and len(orders) < _MOST:
            peak = int(np.argmax(np.where(left, strength, 0.0)))
            orders.append(float(self.cycles_per_m[peak]))
            left[max(peak - apart, 0) : peak + apart + 1] = False
        return np.array(orders)


def _blackman_harris(samples: int) -> Floats:
    """The window with four terms, symmetrical (Harris, Proc. IEEE 66(1), 1978)."""
    angle = np.linspace(-np.pi, np.pi, samples)
    terms = enumerate((0.35875, 0.48829, 0.14128, 0.01168))
    return np.asarray(sum(weight * np.cos(order * angle) for order, weight in terms))


def _medians(values: Floats, beside: int, chosen: NDArray[np.bool_]) -> Floats:
    """Median of each chosen value and so many on each side; the ends are mirrored."""
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(values, beside, mode="symmetric"), 2 * beside + 1)
    return np.asarray(np.median(windows[chosen], axis=1))


def _over_position(residual: Floats, position_m: Floats, step_m: float) -> Floats:
    """Means of the residual over even steps of the position."""
    way = np.abs(position_m - position_m[0])
    way = np.maximum.accumulate(way) + np.arange(way.size) * 1e-9 * step_m
    edges = np.arange(0.0, way[-1], step_m)
    total = np.interp(edges, way, np.cumsum(residual))
    count = np.interp(edges, way, np.arange(way.size, dtype=np.float64))
    return np.asarray(np.diff(total) / np.maximum(np.diff(count), 1e-9))


_SLOWER = 0.5  # of the first stroke's speed: lowest speed of a later one
_GRID = 64  # frequencies at which the model's gain is computed


class RippleMonitor(StatefulBase):
    """Orders of a ripple that the settings name, or that the previous strokes show (`OrderSpectrum`).

    Five strokes whose order does not meet a line are needed to find it. Delay: an order is used from the chunk on in
    which it is found. A ripple that meets a line in every stroke is not found; name it in the settings then.
    """

    _stage = Stage("ripple-watch", 1)

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._spectrum: OrderSpectrum | None = None
        self._made_for = np.zeros(2)  # way and slowest speed
        self.orders = settings.ripple
        """The known orders."""

    def process(self, residual: Floats, chunk: Chunk, model: MovingModel) -> None:
        """Process a model's residual of a chunk, (samples,)."""
        if self._settings.ripple:
            return
        strokes = list(self._strokes(residual, chunk))
        if not strokes:
            return
        slowest = min(abs(x[-1] - x[0]) * chunk.rate_hz / (x.size - 1) for _, x in strokes)
        spectrum = self._spectrum or self._make(np.array([model.high_m - model.low_m, _SLOWER * slowest]))
        for torque, position_m in strokes:
            spectrum.add(torque, position_m, _Gain(model, float(position_m.mean()), self._settings))
        orders = spectrum.found()
        sizes = spectrum.amplitudes(orders)
        self.orders = tuple(RippleOrder(float(k), float(a)) for k, a in zip(orders, sizes) if a > 0)

    def power(self, chunk: Chunk, sample: NDArray[np.int64]) -> Floats:
        """Power of the ripple at the lines of windows that end at these samples, (rows, lines)."""
        speed = RippleSpeed(self._settings.lines).at(chunk.x, sample - chunk.start)
        return ripple_power(self.orders, self._settings.lines, speed)

    def _make(self, made_for: Floats) -> OrderSpectrum:
        self._made_for = made_for
        self._spectrum = OrderSpectrum(self._settings.lines, float(made_for[0]), float(made_for[1]))
        return self._spectrum

    def _strokes(self, residual: Floats, chunk: Chunk) -> Iterator[tuple[Floats, Floats]]:
        """Residual and shaft's position of consecutive steady windows."""
        window = self._settings.lines.window
        newest = np.arange(chunk.first + window - 1, chunk.stop, window)
        begin = newest - chunk.start - window + 1
        whole = np.array([np.isfinite(residual[b : b + window]).all() for b in begin], dtype=np.bool_)
        steady = np.flatnonzero(steady_rows(newest, chunk, window) & whole)
        if not steady.size:
            return
        shaft_m = shaft_position(chunk.x, chunk.y, window, chunk.rate_hz)
        for piece in np.split(steady, np.flatnonzero(np.diff(steady) > 1) + 1):
            cut = slice(int(begin[piece[0]]), int(begin[piece[-1]]) + window)
            yield residual[cut], shaft_m[cut]

    def _state(self) -> dict[str, Any]:
        orders = [[order.cycles, order.amplitude] for order in self.orders]
        return {"orders": orders, "made_for": self._made_for, "spectrum": self._spectrum}

    def _load(self, state: dict[str, Any]) -> None:
        self.orders = tuple(RippleOrder(float(cycles), float(amplitude)) for cycles, amplitude in state["orders"])
        self._spectrum, self._made_for = None, state["made_for"]
        if state["spectrum"] is not None:
            self._make(self._made_for).restore(state["spectrum"])


class _Gain:
    """|G| of a model at a fixed position, interpolated between frequencies."""

    def __init__(self, model: MovingModel, position_m: float, settings: Settings) -> None:
        rate_hz = settings.lines.rate_hz
        highest = 2 * float(settings.lines.frequency_hz[-1])
        self._at = np.linspace(highest / _GRID, highest, _GRID)
        z = np.exp(2j * np.pi * self._at / rate_hz)
        self._gain = np.abs(sampled(model, np.array([position_m]), z, rate_hz))[0]

    def __call__(self, frequency_hz: Floats) -> Floats:
        return np.asarray(np.interp(frequency_hz, self._at, self._gain))
