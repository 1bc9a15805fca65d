"""Quantities that the page can show: plant, open loop, closed loop or sensitivity, if the loop is known."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import field, replace
from functools import cached_property
from math import log10
from typing import Any, get_args

import numpy as np

from livebode.arrays import Complex
from livebode.configuration import recorded_loop
from livebode.core import (
    Lines,
    Loop,
    Model,
    PlantKinds,
    Quantity,
    Responses,
    ServerError,
    SourceUnit,
    split_plant_unit,
)
from livebode.dataclass import dataclass
from livebode.estimation import convert
from livebode.language import Message
from livebode.records import kinds_in, lines_in, source_unit_in

QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)
POWERS = range(-2, 3)
_SECONDS = re.compile(r"(.*[^/])/s(?:\^?([2-9])|([²³⁴]))?")
_RAISED = str.maketrans("²³⁴", "234")
_UNKNOWN, _REMEDY = (
    Message("the run's configuration contains no controllers"),
    Message("describe its controllers under [loop]"),
)


@dataclass(frozen=True)
class Quantities:
    """Conversions between the quantities of one run.

    Parameters
    ----------
    own
        The measured quantity of the run.
    unit
        Its unit.
    lines
        The lines of the run.
    loop
        The loop of the configuration; None if it cannot be built.
    kinds
        Kinds of the plant's output and input.
    source_unit
        Its unit in the units of the source; None if it is the same.
    """

    own: Quantity
    unit: str
    lines: Lines
    loop: Loop | None
    kinds: PlantKinds = field(default_factory=PlantKinds)
    source_unit: SourceUnit | None = None

    @classmethod
    def of(cls, summary: Mapping[str, Any]) -> Quantities:
        """Build it from run.json."""
        settings = summary["found"]
        lines = lines_in(settings)
        try:
            loop = recorded_loop(dict(summary)).build(lines.rate_hz)
        except ValueError:  # of livebode or of pydantic
            loop = None
        return cls(settings["quantity"], settings["unit"], lines, loop, kinds_in(settings), source_unit_in(settings))

    @property
    def feedback(self) -> Model | None:
        """The described controllers; None without a description."""
        return None if self.loop is None else self.loop.feedback

    def why_not(self, quantity: Quantity) -> str:
        """The reason why the page cannot show a quantity; empty if it can."""
        shown = quantity == self.own or (self.loop is not None and self.loop.feedback is not None)
        return "" if shown else Message("{message}; {remedy}", message=_UNKNOWN, remedy=_REMEDY)

    def check(self, quantity: Quantity) -> None:
        """Raise ServerError if the page cannot show a quantity."""
        if self.why_not(quantity):
            raise ServerError("quantity-unavailable", _UNKNOWN, _REMEDY, quantity=quantity)

    def unit_of(self, quantity: Quantity) -> str:
        """The unit of a quantity; empty if it has none or is unknown."""
        return self.unit if quantity == self.own else ""

    def units_of(self, quantity: Quantity) -> list[str]:
        """The units of a quantity times (jω)ⁿ for n from −2 to 2: of derivatives and integrals."""
        return [per_seconds(self.unit_of(quantity), power) for power in POWERS]

    def in_source_units(self, quantity: Quantity) -> dict[str, Any] | None:
        """`units_of` in the units of the source, and its values above SI in dB; None if they are the same."""
        if self.source_unit is None or quantity != self.own:
            return None
        units = [per_seconds(self.source_unit.unit, power) for power in POWERS]
        return {"units": units, "db": 20 * log10(self.source_unit.factor)}

    def fit(self, responses: Responses) -> bool:
        """Whether responses have this run's quantity and frequencies; those of a previous run may differ."""
        at_hz = responses.lines.frequency_hz
        return responses.quantity == self.own and np.array_equal(at_hz, self.lines.frequency_hz)

    def of_responses(self, responses: Responses, quantity: Quantity) -> Responses:
        """The responses as another quantity, sigma to first order; ServerError if impossible."""
        if quantity == responses.quantity:
            return responses
        self.check(quantity)
        value, slope = self.converted(responses.value, quantity, self._feedback)
        return replace(
            responses,
            value=value,
            sigma=responses.sigma * np.abs(slope),
            distortion=responses.distortion * np.abs(slope),
            variation=responses.variation * np.abs(slope),
            quantity=quantity,
            unit=self.unit_of(quantity),
        )

    def converted(self, value: Complex, quantity: Quantity, feedback: Complex) -> tuple[Complex, Complex]:
        """Values of the run's own quantity as another, and the derivative; shapes (..., lines)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            plant, back = _plant(self.own, value, feedback)
            result, on = convert(quantity, plant, feedback)
            return result, on * back

    @cached_property
    def _feedback(self) -> Complex:
        assert self.loop is not None
        return self.loop.feedback_at(self.lines.frequency_hz)


def _plant(quantity: Quantity, value: Complex, feedback: Complex) -> tuple[Complex, Complex]:
    """The plant from a quantity at the plant input, and its derivative: the inverse of `convert`."""
    if quantity == "plant":
        return value, np.ones_like(value)
    if quantity == "open loop":
        return value / feedback, np.broadcast_to(1 / feedback, value.shape)
    if quantity == "sensitivity":
        return (1 / value - 1) / feedback, -1 / (feedback * value**2)
    return value / (feedback * (1 - value)), 1 / (feedback * (1 - value) ** 2)


def per_seconds(unit: str, power: int) -> str:
    """The unit of a plant times (jω) to a power: the seconds belong to the unit of its output.

    >>> per_seconds("rad/s/(N m)", 1), per_seconds("rad/s/(N m)", -1), per_seconds("m/(A)", 2), per_seconds("", -1)
    ('rad/s²/(N m)', 'rad/(N m)', 'm/s²/(A)', 's')
    """
    output, input = split_plant_unit(unit)
    behind = f"/({input})" if input else ""
    output = output or unit
    match = _SECONDS.fullmatch(output)
    own, exponent = (match[1], int((match[2] or match[3] or "1").translate(_RAISED))) if match else (output, 0)
    exponent += power
    if exponent == 0:
        return own + behind
    seconds = "s" + {1: "", 2: "²", 3: "³", 4: "⁴"}[abs(exponent)] if abs(exponent) <= 4 else f"s^{abs(exponent)}"
    if exponent > 0:
        return f"{own or '1'}/{seconds}{behind}"
    return f"{own} {seconds}".strip() + behind
