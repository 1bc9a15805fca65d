"""Units and kinds of computed channels."""

from __future__ import annotations

from dataclasses import dataclass, replace

from livebode.core import Channel, QuantityKind, UsageError

_UNIT_MAX = 64
_DERIVATIVE: dict[str, QuantityKind] = {"position": "velocity", "velocity": "acceleration"}


@dataclass(frozen=True)
class Quantity:
    """What a part of an expression measures.

    Attributes
    ----------
    unit, kind
        As of a channel; a kind of None follows from the unit.
    scaled
        Whether a number may have converted it to another unit.
    number
        The value of a constant; None for a signal.
    """

    unit: str = ""
    kind: QuantityKind | None = None
    scaled: bool = False
    number: float | None = None

    @classmethod
    def of(cls, channel: Channel) -> Quantity:
        """That of a channel."""
        return cls(channel.unit, channel.stated_kind)


def sum_of(a: Quantity, b: Quantity) -> Quantity:
    """A sum or a difference: of the unit of both, or of the one that no number converts.

    >>> sum_of(Quantity("m"), Quantity("rad", scaled=True)).unit
    'm'
    """
    if b.number is not None or a.number is not None:
        return a if a.number is None else b
    if (a.unit, a.kind) == (b.unit, b.kind):
        return replace(a, scaled=a.scaled and b.scaled)
    if not a.unit or not b.unit:
        return a if a.unit else b
    if a.scaled == b.scaled:
        if a.scaled:
            return Quantity(scaled=True)
        raise UsageError(
            "conflict",
            f"a channel in {a.unit} and one in {b.unit} are added",
            "multiply one of them by the factor between the units",
            units=[a.unit, b.unit],
        )
    return b if a.scaled else a


def product(a: Quantity, b: Quantity) -> Quantity:
    """A product; a number is without a unit."""
    for one, other in ((a, b), (b, a)):
        if one.number is not None:
            return replace(other, scaled=other.scaled or abs(one.number) != 1)
    return Quantity(_text(f"{_grouped(a.unit)} {_grouped(b.unit)}") if a.unit and b.unit else "")


def quotient(a: Quantity, b: Quantity) -> Quantity:
    """A quotient; of equal units it has none."""
    if b.number is not None:
        return product(a, b)
    if a.number is not None:
        return Quantity(_text(f"1/({b.unit})") if b.unit else "")
    return Quantity(_text(f"{a.unit}/({b.unit})") if a.unit and b.unit and a.unit != b.unit else "")


def derivative(x: Quantity) -> Quantity:
    """Per second.

    >>> derivative(Quantity("rad")).unit, derivative(Quantity("rad/s")).unit, derivative(Quantity("", "position")).kind
    ('rad/s', 'rad/s²', 'velocity')
    """
    unit = "" if not x.unit else f"{x.unit}²" if x.unit.endswith("/s") else f"{x.unit}/s"
    return Quantity(_text(unit), _DERIVATIVE.get(x.kind or ""), x.scaled)


def _grouped(unit: str) -> str:
    return f"({unit})" if "/" in unit else unit


def _text(unit: str) -> str:
    return unit if len(unit) <= _UNIT_MAX else ""
