"""[orders]: shafts that turn with the axis, and the torque that repeats with their angle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from livebode.configuration.section import ConfigurationSection, Positive
from livebode.core import UsageError

if TYPE_CHECKING:
    from livebode.motion import Shaft

_HIGHEST = 48

Order = Annotated[int, Field(ge=1)]


class OrdersSection(ConfigurationSection):
    """[orders]: the angle of the motor, and the shafts, for `livebode orders` and for the orders of a baseline.

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

    def all_shafts(self) -> list[Shaft]:
        """The shafts with their orders; UsageError if orders name a shaft that is absent."""
        from livebode.motion import Shaft  # not every configuration has this section

        turns = {"motor": 1.0} | self.shafts
        if unknown := [name for name in self.orders if name not in turns]:
            raise UsageError(
                "unknown-name",
                f"orders.orders names the shaft {unknown[0]!r}, which orders.shafts does not have",
                f"choose one of {', '.join(turns)}",
                value=unknown[0],
                allowed=list(turns),
            )
        orders = self.orders or {"motor": list(range(1, _HIGHEST + 1))}
        return [Shaft(name, turns[name], tuple(each)) for name, each in orders.items()]
