"""The quantity of a channel by its unit, or else by its name."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from livebode.core import Channel, QuantityKind

DRIVING: tuple[QuantityKind, ...] = ("torque", "current", "force")
NAMED_INPUT = re.compile(r"^(u|i_?q|torque|current|force|motor|input|effort|drehmoment|strom|kraft)", re.IGNORECASE)
NAMED_OUTPUT = re.compile(
    r"^(y|vel\w*|speed|omega|theta|angle|phi|pos\w*|acc\w*|gyro\w*|output|drehzahl)", re.IGNORECASE
)
_NAMED_ACCELERATION = re.compile(r"acc(?!e[ps]s?|u)|beschl|adxl", re.IGNORECASE)


class ChannelQuantities:
    """What drives a machine and what is its motion, among some channels.

    Parameters
    ----------
    channels
        Channels with their kinds; a name that is not among them, or whose kind is "other", is judged by itself.

    Examples
    --------
    >>> found = ChannelQuantities([Channel("F", "N"), Channel("sensor 2", "g")])
    >>> found.drives("F"), found.drives("-torque"), found.accelerates("sensor 2"), found.accelerates("Accel_x")
    (True, True, True, True)
    """

    def __init__(self, channels: Iterable[Channel] = ()) -> None:
        self._kinds: Mapping[str, QuantityKind] = {channel.name: channel.kind for channel in channels}

    def drives(self, name: str) -> bool:
        """Whether it is a torque, a current or a force."""
        kind = self._kinds.get(name, "other")
        return kind in DRIVING or (kind == "other" and bool(NAMED_INPUT.search(_unsigned(name))))

    def moves(self, name: str) -> bool:
        """Whether it is a position, a velocity or an acceleration."""
        kind = self._kinds.get(name, "other")
        if kind == "other":
            return bool(NAMED_OUTPUT.search(_unsigned(name)) or _NAMED_ACCELERATION.search(name))
        return kind not in DRIVING

    def accelerates(self, name: str) -> bool:
        """Whether it is an acceleration."""
        kind = self._kinds.get(name, "other")
        return kind == "acceleration" or (kind == "other" and bool(_NAMED_ACCELERATION.search(name)))


def _unsigned(name: str) -> str:
    return name.lstrip("+-( ")
