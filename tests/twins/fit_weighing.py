"""The NumPy twin of a row's weights: its noise, and the relative model error ε that explains the rest."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from tests.twins.fit_arithmetic import Complex, Curve, Floats, total

_EPSILON_STEPS, _CLOSE = 30, 1e-6


class WeighedRow:
    """A row as it is fitted: measured parts, squared noise (0: not known), squared weights and sizes."""

    def __init__(self, value: Complex, sigma: Floats, use: npt.NDArray[np.bool_]) -> None:
        self.use, self.count = use, int(np.count_nonzero(use))
        self.value: Curve = np.where(use, value.real, 0.0), np.where(use, value.imag, 0.0)
        self.noise = np.where(use & (sigma > 0), sigma * sigma, 0.0)
        self.size = self.value[0] * self.value[0] + self.value[1] * self.value[1]
        self.rest = np.zeros(len(use))
        self.weight = self.rest

    def weigh(self, epsilon: Any) -> None:
        """For the present sizes; by size alone where neither noise nor ε is known."""
        self.weight = self._weights(epsilon * epsilon)
        if not (self.weight > 0).any():
            self.weight = self._weights(1.0)

    def _weights(self, square: Any) -> Floats:
        variance = self.noise + square * self.size
        return np.where(self.use & (variance > 0), 2.0 / variance, 0.0)

    def take_residuals(self, response: Curve) -> None:
        re, im = self.value[0] - response[0], self.value[1] - response[1]
        self.rest = np.where(self.use, re * re + im * im, 0.0)
        self.size = np.where(self.use, response[0] * response[0] + response[1] * response[1], 0.0)

    def epsilon(self, dof: Any) -> np.float64:
        return model_error(self.rest, self.noise, self.size, dof)

    def reduced(self, square: Any) -> np.float64:
        return _reduced(self.rest, self.noise, self.size, square)


def _reduced(rest: Floats, noise: Floats, size: Floats, square: Any) -> np.float64:
    return total(np.where(rest > 0, 2.0 * rest / (noise + square * size), 0.0))


def model_error(rest: Floats, noise: Floats, size: Floats, dof: Any) -> np.float64:
    """ε ≥ 0 with Σ 2·rest/(noise + ε²·size) = dof."""
    if not dof > 0 or _reduced(rest, noise, size, 0.0) <= dof:
        return np.float64(0.0)
    # No line has more than all together, which bounds ε² from below; from there the left side is convex and falls, so
    # that Newton's steps climb to the root and never pass it.
    least = (2.0 * rest / dof - noise) / size
    square = np.max(np.where((rest > 0) & np.isfinite(least), least, 0.0), initial=0.0)
    for _ in range(_EPSILON_STEPS):
        share = np.where(rest > 0, 1.0 / (noise + square * size), 0.0)
        every, falls = 2.0 * total(rest * share), 2.0 * total(rest * share * (size * share))
        step = (every - dof) / falls if falls > 0 else np.float64(0.0)
        square = square + np.maximum(step, 0.0)
        if not step > _CLOSE * square:
            break
    return np.sqrt(square) if np.isfinite(square) else np.float64(0.0)
