"""The modes that the lines show: between lines that are wider apart than a resonance, and above the highest line."""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Literal

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.dataclass import dataclass

DAMPING_LEAST = 0.003
"""Least damping ratio of a mode above the lines: that of steel screwed to steel."""

UNSEEN_MOST = 20.0
"""Largest rise over the fall, 26 dB, of a mode that the lines do not show: of two equal inertias damped with 0.025."""

_OCTAVES = 8  # below the highest line
_LINES_MIN = 10
_DAMPINGS = (DAMPING_LEAST, 0.02, 0.06)
_PER_OCTAVE = 48  # places tried for a mode
_MODES_MAX = 5
_PRICE = 30.0  # of χ² for a mode: its three parameters, and the many places that are tried
_SHARE = 0.05  # of χ² that a mode has to remove
_HOPELESS = 100.0  # times the χ² of another output with no more modes
_MODEL = 2e-3  # least error of a value: a machine is not quite a chain
_BOUND = 1.64  # in sigma, of the weight of a mode above the lines: 95 % to one side
_EVALUATIONS, _CHANGE = 20, 1e-5  # the latter of χ²: a smaller one ends a search
_ROUNDING = 1e-14  # of the power of a column that is a combination of those that are fitted
_GAP_MAX = 0.25  # of the frequency: in a wider gap between lines another mode may be
_CLEAR = 5.0  # least |G| over sigma of the lines beside a mode: a narrow one between noisy lines may be noise
_VALID = 2.0  # most sigma of the residual of a fit that is used between the lines

Output = Literal["velocity", "differenced", "position"]


@dataclass(frozen=True, eq=False)
class _Modes:
    """Modes at the lines: each frequency with each of `_DAMPINGS`.

    Attributes
    ----------
    hz, damping
        Shape (modes,).
    parts
        Real and imaginary parts at the lines, shape (modes, 2·lines).
    power
        Square of the size at the lines, shape (modes, lines).
    """

    hz: Floats
    damping: Floats
    parts: Floats
    power: Floats

    @classmethod
    def of(cls, lines_hz: Floats, hz: Floats) -> _Modes:
        hz, damping = (x.ravel() for x in np.meshgrid(hz, _DAMPINGS, indexing="ij"))
        value = _mode(lines_hz, hz[:, np.newaxis], damping[:, np.newaxis])
        parts = np.concatenate([value.real, value.imag], axis=1)
        return cls(hz, damping, parts, value.real**2 + value.imag**2)


@dataclass(frozen=True, eq=False)
class ModalFit:
    """A chain of inertias with a delay, fitted to the upper lines of one place.

    j·2πf·G of torque and velocity at the same inertia is a + Σ b·f²/(f² − fm² − 2j·ζ·fm·f) behind a delay: the rigid
    body and the modes. Of a mode above the lines, −b·(f/fm)² remains within them. Beside these, friction and modes far
    below the lines are fitted, as j/f and 1/f². A mode is added where it removes most of the residual. Where the
    output is a difference of angles, or a position, is chosen by the fit, too.

    Attributes
    ----------
    frequency_hz, value, weight
        The lines, G over a rigid body of inertia one, and one over its sigma; shape (lines,).
    rate_hz, output
        As the output is sampled.
    tried
        The modes of which some are added.
    theta
        Delay in turns at the highest line; logarithms of frequency and damping ratio of each mode.
    """

    frequency_hz: Floats
    value: Complex
    weight: Floats
    rate_hz: float
    output: Output
    tried: _Modes
    theta: Floats

    @classmethod
    def of(cls, lines_hz: Floats, value: Complex, sigma: Floats, rate_hz: float) -> ModalFit:
        """The fit of one place, values of shape (lines,)."""
        outputs: tuple[Output, ...] = ("velocity", "differenced", "position")
        use = lines_hz >= min(lines_hz[-1] / 2**_OCTAVES, lines_hz[-min(_LINES_MIN, lines_hz.size)])
        f, octaves = lines_hz[use], np.log2(rate_hz / lines_hz[use][0])
        tried = _Modes.of(f, f[0] / 2 * 2 ** (np.arange(int(octaves * _PER_OCTAVE)) / _PER_OCTAVE))
        least = np.full(_MODES_MAX + 1, np.inf)
        fits = [cls._begun(f, value[use], sigma[use], rate_hz, output, tried)._grown(least) for output in outputs]
        return min(fits, key=lambda fit: fit.chi2 + _PRICE * len(fit.modes))

    @classmethod
    def _begun(
        cls, f: Floats, value: Complex, sigma: Floats, rate_hz: float, output: Output, tried: _Modes
    ) -> ModalFit:
        """Without a mode, with the best delay."""
        scale = 1 / _rigid(f, rate_hz, output)
        y = value * scale
        size = np.abs(y)
        weight = 1 / np.hypot(np.abs(scale) * sigma, _MODEL * np.maximum(size, np.median(size)))
        # Without its delay y is real but for its sign: then its square has the phase of twice the delay.
        turns = np.arange(-0.1, 4.0, 0.02)
        square = (y / np.maximum(size, 1e-300)) ** 2
        real = np.real(np.exp(4j * np.pi * np.outer(turns, f / f[-1])) @ square)
        return cls(f, y, weight, rate_hz, output, tried, turns[[np.argmax(real)]])._refined()

    def _with(self, theta: Floats) -> ModalFit:
        return ModalFit(self.frequency_hz, self.value, self.weight, self.rate_hz, self.output, self.tried, theta)

    @property
    def modes(self) -> Floats:
        """Frequency in Hz and damping ratio, shape (modes, 2)."""
        return np.asarray(np.exp(self.theta[1:]).reshape(-1, 2))

    def _columns(self, frequency_hz: Floats) -> Complex:
        """Rigid body, friction, modes far below and those fitted, behind the delay; shape (frequencies, columns)."""
        f, first, top = frequency_hz, self.frequency_hz[0], self.frequency_hz[-1]
        rows = [np.ones_like(f), 1j * first / f, (first / f) ** 2, *(_mode(f, *mode) for mode in self.modes)]
        return np.asarray(np.stack(rows, 1) * np.exp(-2j * np.pi * f / top * self.theta[0])[:, np.newaxis])

    def _stacked(self, columns: Complex) -> Floats:
        weighted = (columns.T * self.weight).T
        return np.concatenate([weighted.real, weighted.imag])

    @cached_property
    def _solution(self) -> tuple[Floats, Floats]:
        """Weights of the columns, and the weighted residual."""
        a, b = self._stacked(self._columns(self.frequency_hz)), self._stacked(self.value)
        linear = np.linalg.lstsq(a, b, rcond=None)[0]
        return np.asarray(linear, dtype=np.float64), b - a @ linear

    @property
    def chi2(self) -> float:
        residual = self._solution[1]
        return float(residual @ residual)

    @property
    def excess(self) -> float:
        """Sigma of the weighted residual, 1 or more."""
        left = 2 * self.frequency_hz.size - self.theta.size - self._solution[0].size
        return float(max(np.sqrt(self.chi2 / max(left, 1)), 1.0))

    def _refined(self) -> ModalFit:
        from scipy.optimize import least_squares

        n = len(self.modes)
        low = np.concatenate([[-0.5], np.tile(np.log([self.frequency_hz[0] / 3, 2e-4]), n)])
        high = np.concatenate([[4.0], np.tile(np.log([self.rate_hz, 0.5]), n)])
        start = np.clip(self.theta, low + 1e-6, high - 1e-6)

        @lru_cache(maxsize=1)  # the residual and its slopes are asked for one after the other
        def at(theta: bytes) -> ModalFit:
            return self._with(np.frombuffer(theta))

        def residual(theta: Floats) -> Floats:
            return at(theta.tobytes())._solution[1]

        def slopes(theta: Floats) -> Floats:
            return at(theta.tobytes())._residual_slopes

        solution = least_squares(residual, start, slopes, bounds=(low, high), max_nfev=_EVALUATIONS, ftol=_CHANGE)
        return self._with(np.asarray(solution.x))

    @property
    def _residual_slopes(self) -> Floats:
        """Slopes of the weighted residual by theta, which the weights of the columns follow (Kaufman 1975, BIT 15)."""
        slopes, linear = self._stacked(self._slopes(self.frequency_hz)), self._solution[0].size
        q = np.linalg.qr(slopes[:, :linear])[0]
        return np.asarray(q @ (q.T @ slopes[:, linear:]) - slopes[:, linear:])

    def _grown(self, least: Floats) -> ModalFit:
        """With all modes that are worth their price, while it may become the best.

        `least` has the least χ² of each number of modes or fewer, of this and the other outputs, and is updated.
        """
        fit = self
        while True:
            modes = len(fit.modes)
            least[modes:] = np.minimum(least[modes:], fit.chi2)
            hopeless = fit.chi2 > _HOPELESS * least[modes]
            if hopeless or modes == _MODES_MAX or self.frequency_hz.size <= fit.theta.size + 5:
                break
            tried = fit._with_a_mode()._refined()
            # Where the model errs, a mode has to remove a share of the error.
            if fit.chi2 - tried.chi2 < max(_PRICE, _SHARE * fit.chi2):
                break
            fit = tried
        return fit

    def _with_a_mode(self) -> ModalFit:
        """With the mode that removes most of the residual."""
        size, sigma = self._added(self.tried)
        best = int(np.argmax(np.abs(size) / sigma))
        return self._with(np.append(self.theta, np.log([self.tried.hz[best], self.tried.damping[best]])))

    def _added(self, modes: _Modes) -> tuple[Floats, Floats]:
        """Weight and sigma of each of these modes, if it were added, and all that is fitted could change."""
        f, residual = self.frequency_hz, self._solution[1]
        q = np.linalg.qr(self._stacked(self._slopes(f)))[0]
        rows = np.column_stack([q, residual - q @ (q.T @ residual)])
        late = self.weight * np.exp(-2j * np.pi * f / f[-1] * self.theta[0])
        # A stacked column times a row is the real part of the column times the conjugate row.
        turned = late[:, np.newaxis] * (rows[: f.size] - 1j * rows[f.size :])
        products = modes.parts @ np.concatenate([turned.real, -turned.imag])
        whole = modes.power @ self.weight**2
        power = np.maximum(whole - np.sum(products[:, :-1] ** 2, axis=1), _ROUNDING * whole)
        return products[:, -1] / power, 1 / np.sqrt(power)

    def _slopes(self, frequency_hz: Floats) -> Complex:
        """By the weights and by theta, shape (frequencies, parameters)."""
        f, top, linear = frequency_hz, self.frequency_hz[-1], self._solution[0]
        columns = self._columns(f)
        slopes = [columns @ linear * (-2j * np.pi * f / top)]
        for weight, column, (hz, damping) in zip(linear[3:], columns[:, 3:].T, self.modes):
            part = weight * column * _mode(f, hz, damping) / f**2
            slopes += [part * 2 * hz * (hz + 1j * damping * f), part * 2j * damping * hz * f]
        return np.column_stack([columns, *slopes])

    def response(self, frequency_hz: Floats) -> Complex:
        """G of the model."""
        linear = self._solution[0]
        return np.asarray(self._columns(frequency_hz) @ linear * _rigid(frequency_hz, self.rate_hz, self.output))

    def sigma(self, frequency_hz: Floats) -> Floats:
        """Standard deviation of `response`."""
        r = np.linalg.qr(self._stacked(self._slopes(self.frequency_hz)))[1]
        rows = np.linalg.lstsq(r.T, self._slopes(frequency_hz).T, rcond=None)[0]
        size = np.abs(_rigid(frequency_hz, self.rate_hz, self.output))
        return np.asarray(self.excess * np.sqrt(np.sum(np.abs(rows) ** 2, axis=0)) * size)

    def narrow(self, lines_hz: Floats) -> Floats:
        """Frequency and half-width in Hz of the modes that are narrower than the distance of lines, (modes, 2)."""
        if self.excess > _VALID:
            return np.empty((0, 2))
        hz, damping = self.modes.T
        distance = np.diff(lines_hz)[np.clip(np.searchsorted(lines_hz, hz) - 1, 0, lines_hz.size - 2)]
        clear = np.abs(self.value) * self.weight > _CLEAR
        beside = np.clip(np.searchsorted(self.frequency_hz, hz), 1, self.frequency_hz.size - 1)
        use = (hz < lines_hz[-1]) & (hz > lines_hz[0]) & (damping * hz < distance) & (distance < _GAP_MAX * hz)
        use &= clear[beside - 1] & clear[beside]
        return np.asarray(np.column_stack([hz, damping * hz])[use])

    @property
    def shown_hz(self) -> float:
        """The lowest mode above the lines that they show; NaN without one."""
        above = self.modes[self.modes[:, 0] > self.frequency_hz[-1], 0]
        return float(above.min()) if above.size else float("nan")

    def above(self, frequency_hz: Floats) -> tuple[Floats, Floats]:
        """|G| above the lines without a mode there, and the factor by which the lines permit a mode to exceed it.

        A mode that they show may be anywhere above them, with a damping ratio of 0.003 or more. The weight of one that
        they do not show is up to its one-sided 95 % bound, and its rise up to `UNSEEN_MOST`.
        """
        f, inside = frequency_hz, self.modes[:, 0] <= self.frequency_hz[-1]
        weights = self._solution[0]
        below = [w * _mode(f, *mode) for w, mode in zip(weights[3:][inside], self.modes[inside])]
        # The difference of angles is 0 at half the rate, which a mode there does not know: so its fall is left out.
        order = 2 if self.output == "position" else 1
        size = np.maximum(np.abs(weights[0] + np.sum(below, axis=0)), np.abs(weights[0]))
        modes = _Modes.of(self.frequency_hz, f)
        weight, sigma = self._added(modes)
        most = np.maximum(weight, 0) + _BOUND * self.excess * sigma
        peak = (most / (2 * modes.damping)).reshape(f.size, len(_DAMPINGS)).max(axis=1)
        # What the lines show of a mode is its weight over the square of its frequency, so a lower one has less weight.
        shown = np.zeros(f.shape)
        for w, mode_hz in zip(np.abs(weights[3:][~inside]), self.modes[~inside, 0]):
            shown = np.maximum(shown, w * np.minimum(f / mode_hz, 1.0) ** 2 / (2 * DAMPING_LEAST))
        size = np.maximum(size, 1e-300)
        # The worse the fit, the less it excludes.
        rise = 1 + np.maximum(np.minimum(peak / size, UNSEEN_MOST * self.excess), shown / size)
        return size * (2 * self.rate_hz * np.sin(np.pi * f / self.rate_hz)) ** -order, rise


def _rigid(frequency_hz: Floats, rate_hz: float, output: Output) -> Complex:
    """Inertia one behind a hold, but for its delay."""
    half = np.pi * frequency_hz / rate_hz
    integrator = 1 / (2j * rate_hz * np.sin(half))
    return np.asarray(
        integrator if output == "velocity" else np.cos(half) * integrator ** (2 if output == "position" else 1)
    )


def _mode(frequency_hz: Floats, mode_hz: Floats | float, damping: Floats | float) -> Complex:
    f = frequency_hz
    return np.asarray(f**2 / (f**2 - mode_hz**2 - 2j * np.asarray(damping) * mode_hz * f))
