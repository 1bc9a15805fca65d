"""FeedbackParts: F as curves and numbers, so that a program without the controllers computes it for other gains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import inf, isfinite
from typing import NamedTuple

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import PID, Cascade, Model, PositionPD, integral
from livebode.dataclass import dataclass


class FeedbackTerm(NamedTuple):
    """A curve times a parameter to the power 1 or −1; without a name the curve alone."""

    name: str
    power: int
    curve: Complex


@dataclass(frozen=True, eq=False)
class FeedbackParts:
    """F = gain·(sum of the terms)·(1 + outer), at some frequencies.

    Attributes
    ----------
    values
        The described parameters: `gain`, and those that the terms name.
    terms
        At least one.
    outer
        The loop around, times its parameter; None without one.

    Examples
    --------
    >>> parts = FeedbackParts.of(PID(gain=0.2, integral_time_s=0.1, rate_hz=4000), np.array([10.0, 100.0]))
    >>> parts.values
    {'gain': 0.2, 'integral_time_s': 0.1}
    >>> abs(parts.response({"gain": 0.4})).round(4)
    array([0.4055, 0.4006])
    """

    values: Mapping[str, float]
    terms: tuple[FeedbackTerm, ...]
    outer: FeedbackTerm | None = None

    @classmethod
    def of(cls, feedback: Model, frequency_hz: Floats) -> FeedbackParts:
        """The parts of a PID, Cascade or PositionPD; any other feedback has its described shape and a factor of 1."""
        if isinstance(feedback, PID):
            return cls._of_pid(feedback, frequency_hz)
        if isinstance(feedback, Cascade) and isinstance(feedback.position, PID):
            inner = cls._of_pid(feedback.velocity, frequency_hz)
            position = replace(feedback, position=replace(feedback.position, gain=1.0)).outer(frequency_hz)
            values = {**inner.values, "position_gain": feedback.position.gain}
            return cls(values, inner.terms, FeedbackTerm("position_gain", 1, position))
        if isinstance(feedback, PositionPD):
            return cls._of_position_pd(feedback, frequency_hz)
        return cls({"gain": 1.0}, (FeedbackTerm("", 1, feedback.response(frequency_hz)),))

    @classmethod
    def _of_pid(cls, pid: PID, frequency_hz: Floats) -> FeedbackParts:
        values = {"gain": pid.gain}
        unit = replace(pid, gain=1.0, integral_time_s=inf, derivative_time_s=0.0).response(frequency_hz)
        terms = [FeedbackTerm("", 1, unit)]
        if isfinite(pid.integral_time_s):
            values["integral_time_s"] = pid.integral_time_s
            terms.append(
                FeedbackTerm("integral_time_s", -1, unit * integral(frequency_hz, pid.rate_hz, pid.integrator))
            )
        if pid.derivative_time_s:
            values["derivative_time_s"] = pid.derivative_time_s
            slope = 1 / integral(frequency_hz, pid.rate_hz, "backward")
            terms.append(FeedbackTerm("derivative_time_s", 1, unit * slope / (1 + pid.derivative_filter_s * slope)))
        return cls(values, tuple(terms))

    @classmethod
    def _of_position_pd(cls, pd: PositionPD, frequency_hz: Floats) -> FeedbackParts:
        slope = replace(pd, position_gain=0.0, velocity_gain=1.0).response(frequency_hz)
        both = replace(pd, position_gain=1.0, velocity_gain=1.0).response(frequency_hz)
        terms = FeedbackTerm("", 1, slope), FeedbackTerm("position_gain", 1, both - slope)
        return cls({"gain": pd.velocity_gain, "position_gain": pd.position_gain}, terms)

    def response(self, changed: Mapping[str, float] | None = None) -> Complex:
        """F with other values of some parameters."""
        value = {**self.values, **(changed or {})}

        def part(term: FeedbackTerm) -> Complex:
            return np.asarray(term.curve * (value[term.name] ** term.power if term.name else 1.0))

        inner = value["gain"] * np.sum([part(term) for term in self.terms], axis=0)
        return np.asarray(inner if self.outer is None else inner * (1 + part(self.outer)))
