"""What the page can show of a run: plant, open loop, closed loop or sensitivity, where the loop is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from livebode.core import Lines, Loop, Quantity, Responses, ServerError
from livebode.estimation.quantities import convert
from livebode.records.run import lines_in
from livebode.session.axis import LoopSection
from livebode.session.said import said

Complex = NDArray[np.complex128]

QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)
_UNKNOWN, _REMEDY = "the run does not say what feeds back", "describe its controllers under [loop]"


@dataclass(frozen=True)
class Quantities:
    """Conversions between the quantities of one run.

    Parameters
    ----------
    own
        What the run measured.
    unit
        Of it.
    lines
        Where.
    loop
        As its configuration describes it; None where it cannot be built.
    """

    own: Quantity
    unit: str
    lines: Lines
    loop: Loop | None

    @classmethod
    def of(cls, summary: Mapping[str, Any]) -> Quantities:
        """From run.json."""
        found = summary["found"]
        lines = lines_in(found)
        try:
            loop = LoopSection.model_validate(said(dict(summary)).get("loop", {})).build(lines.rate_hz)
        except ValueError:  # ours, or pydantic's
            loop = None
        return cls(found["quantity"], found["unit"], lines, loop)

    def why_not(self, quantity: Quantity) -> str:
        """Why the page cannot show it; empty where it can."""
        shown = quantity == self.own or (self.loop is not None and self.loop.feedback is not None)
        return "" if shown else f"{_UNKNOWN}; {_REMEDY}"

    def check(self, quantity: Quantity) -> None:
        """ServerError where the page cannot show it."""
        if self.why_not(quantity):
            raise ServerError("quantity-unavailable", _UNKNOWN, _REMEDY, quantity=quantity)

    def unit_of(self, quantity: Quantity) -> str:
        """Of the quantity; without one where it has none or nobody says it."""
        return self.unit if quantity == self.own else ""

    def fit(self, responses: Responses) -> bool:
        """Whether responses are of this run's quantity at its frequencies, as those of a run before may not be."""
        at_hz = responses.lines.frequency_hz
        return responses.quantity == self.own and np.array_equal(at_hz, self.lines.frequency_hz)

    def of_responses(self, responses: Responses, quantity: Quantity) -> Responses:
        """The same responses as another quantity; sigma to first order. ServerError where it cannot be."""
        if quantity == responses.quantity:
            return responses
        self.check(quantity)
        value, slope = self.converted(responses.value, quantity, self._feedback)
        return replace(
            responses,
            value=value,
            sigma=responses.sigma * np.abs(slope),
            quantity=quantity,
            unit=self.unit_of(quantity),
        )

    def converted(self, value: Complex, quantity: Quantity, feedback: Complex) -> tuple[Complex, Complex]:
        """Values of the run's own quantity as another, and the derivative; shapes (..., lines)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            plant, back = _plant(self.own, value, feedback)
            found, on = convert(quantity, plant, feedback)
            return found, on * back

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
