"""ARX models y(n) = −Σ a_i·y(n−i) + Σ b_i·u(n−i): regressors, response, and the signals they are best found from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfilt

from studies.peers.recording import HOP, LINES, RATE_HZ


@dataclass(frozen=True)
class Order:
    """a_1 … a_outputs, and b from lag `first` on, `inputs` of them."""

    outputs: int
    inputs: int
    first: int = 1

    def response(self, theta: np.ndarray, rate_hz: float) -> np.ndarray:
        """(rows, outputs + inputs) to (rows, lines)."""
        lag = np.concatenate([np.arange(1, self.outputs + 1), self.first + np.arange(self.inputs)])
        delays = np.exp(-2j * np.pi * np.outer(lag, LINES.frequency_hz) / rate_hz)
        n = self.outputs
        with np.errstate(invalid="ignore"):  # a model before its first full window has no parameters yet
            return (theta[:, n:] @ delays[n:]) / (1 + theta[:, :n] @ delays[:n])

    def regressors(self, u: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Row n is what the model says y(n) from, shape (samples, outputs + inputs); zero before the start."""
        past = [-_delayed(y, i) for i in range(1, self.outputs + 1)]
        return np.stack(past + [_delayed(u, self.first + i) for i in range(self.inputs)], axis=1)


def _delayed(x: np.ndarray, by: int) -> np.ndarray:
    return np.concatenate([np.zeros(by), x[: len(x) - by]])


@dataclass(frozen=True)
class Prepared:
    """Both signals through the same band-pass and then every `every`-th sample: their quotient stays the plant's."""

    low_hz: float
    high_hz: float
    every: int
    order: int

    @property
    def rate_hz(self) -> float:
        return RATE_HZ / self.every

    def signals(self, u: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        sos = butter(self.order, [self.low_hz, self.high_hz], "bandpass", fs=RATE_HZ, output="sos")
        u, y = sosfilt(sos, [u, y])
        return u[self.every - 1 :: self.every], y[self.every - 1 :: self.every]


def rows(samples: int, every: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the newest samples of all rows, and of the newest kept sample at each."""
    newest = np.arange(HOP - 1, samples, HOP)
    return newest, (newest + 1) // every - 1
