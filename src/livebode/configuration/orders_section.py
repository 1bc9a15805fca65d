"""[orders]: shafts that turn with the axis, and the torque that repeats with their angle."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from livebode.configuration.section import ConfigurationSection, Positive

Order = Annotated[int, Field(ge=1)]


class OrdersSection(ConfigurationSection):
    """[orders]: the angle of the motor, and the shafts, for `livebode orders`.

    Parameters
    ----------
    angle
        Channel of the motor's angle. Default: signals.output, or its integral if it is a velocity.
    turn
        Units of the angle in one turn of the motor. Default: 2π.
    shafts
        Turns of each shaft in one turn of the motor: {gear = 0.2}. "motor" has 1.
    orders
        Cycles in one turn of each shaft: {motor = [1, 24], gear = [1, 2]}. Default: 1 … 48 of the motor.
    highest_hz
        Highest frequency of an order; half the antiresonance of an axis with a belt or a coupling is suitable.
    """

    angle: str | None = None
    turn: Positive | None = None
    shafts: dict[str, Positive] = {}
    orders: dict[str, list[Order]] = {}
    highest_hz: Positive | None = None
