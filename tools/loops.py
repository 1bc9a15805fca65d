"""Loops around two masses, as livebode has them and as python-control's transfer functions."""

from __future__ import annotations

from dataclasses import dataclass

import control
import numpy as np

from livebode.analysis import OpenLoop
from livebode.core import PID, Cascade, Loop, Parameters
from livebode.fitting import TwoMass

RADIUS_M = 0.019
MODEL = TwoMass(radius_m=RADIUS_M)
BELT = np.array([0.0028, 6.7, 5e5, 130.0])


def values(belt: np.ndarray = BELT) -> np.ndarray:
    """Parameters of MODEL, with friction and delay at zero, shape (..., parameters)."""
    rest = np.zeros((*np.shape(belt)[:-1], len(MODEL.parameters) - 4))
    return np.concatenate([belt, rest], axis=-1)


def parameters(at: np.ndarray, covariance: np.ndarray | None = None, schedule: np.ndarray | None = None) -> Parameters:
    """Fits of MODEL with these values (rows, 4), and their covariance (rows, 4, 4)."""
    rows = len(at)
    whole = np.zeros((rows, len(MODEL.parameters), len(MODEL.parameters)))
    if covariance is not None:
        whole[:, :4, :4] = covariance
    nothing = np.zeros(rows)
    return Parameters(
        model=MODEL.name,
        names=MODEL.names,
        units=MODEL.units,
        value=values(at),
        covariance=whole,
        status=np.full(rows, "ok"),
        epsilon=nothing,
        chi2=nothing,
        dof=nothing,
        sample=np.arange(rows),
        time_s=nothing,
        schedule=nothing if schedule is None else schedule,
    )


@dataclass(frozen=True)
class Case:
    """A loop around two masses: P or PI velocity controller, P position controller at half the rate, a delay."""

    belt: np.ndarray
    gain: float = 0.2308
    integral_time_s: float = 0.2
    position_gain: float = 1.0
    delay_ticks: int = 0
    rate_hz: float = 4000.0

    @property
    def loop(self) -> Loop:
        velocity = PID(
            gain=self.gain,
            integral_time_s=self.integral_time_s,
            rate_hz=self.rate_hz,
            delay_ticks=self.delay_ticks,
        )
        return Loop(feedback=Cascade(velocity, PID(gain=self.position_gain, rate_hz=self.rate_hz / 2, rate_divider=2)))

    @property
    def open(self) -> OpenLoop:
        return OpenLoop(MODEL, self.loop, self.rate_hz)

    @property
    def factors(self) -> list[control.TransferFunction]:
        """Of L, built by python-control alone."""
        tick = 1 / self.rate_hz
        js, load, k, b = self.belt * [1, RADIUS_M**2, RADIUS_M**2, RADIUS_M**2]
        plant = control.tf([load, b, k], [js * load, (js + load) * b, (js + load) * k, 0])
        z = control.tf([1, 0], [1], tick)
        velocity = self.gain * (1 + tick / self.integral_time_s * z / (z - 1)) / z**self.delay_ticks
        position = self.position_gain * (1 + 1 / z) / 2 * tick * (z + 1) / (2 * (z - 1))
        return [control.c2d(plant, tick, "zoh"), velocity, 1 + position]

    def response(self, frequency_hz: np.ndarray) -> np.ndarray:
        """L, factor by factor: multiplied out, its poles near z = 1 lose their digits."""
        z = np.exp(2j * np.pi * frequency_hz / self.rate_hz)
        return np.prod([factor(z) for factor in self.factors], axis=0)

    @property
    def largest_pole(self) -> float:
        """Of the closed loop; it is stable below 1."""
        return float(np.max(np.abs(control.feedback(np.prod(self.factors)).poles())))
