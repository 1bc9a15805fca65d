"""What a channel measures, from its unit and its name, and its SI unit: the one place where units are converted."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import Channel, QuantityKind, UsageError, read_quantity, read_unit
from livebode.dataclass import dataclass

_NAMES: Mapping[QuantityKind, re.Pattern[str]] = {
    "acceleration": re.compile(r"acceler|beschleunig|加速度|(?<![a-z])acc(?![a-z])"),
    "torque": re.compile(r"torque|moment(?!a)|(?<![a-z])trq(?![a-z])|转矩|扭矩|力矩"),
    "velocity": re.compile(r"speed|velocit|drehzahl|geschwindigkeit|转速|(?<!加)速度|(?<![a-z])(?:vel|omega)(?![a-z])"),
    "position": re.compile(
        r"position|angle|winkel|位置|角度|lage(?:ist|soll)|(?:(?<![a-z])|ist|soll)lage(?![a-z])|(?<![a-z])pos(?![a-z])"
    ),
    "force": re.compile(r"force|(?<!t)kraft|推力"),
    "current": re.compile(r"strom|电流|(?<![a-z])i_?q(?![a-z])|(?<![a-z])current$"),
}
"""Words of one kind of quantity, without capitals; "current" alone is also an adjective."""
_WORDS = re.compile(r"[_\s.]+|(?<=[a-z])(?=[A-Z][A-Za-z]+$)")
_SUFFIXES: Mapping[str, str] = {
    "rpm": "rpm", "nm": "N m", "mnm": "mN m", "ncm": "N cm", "deg": "deg", "mdeg": "mdeg", "rad": "rad", "mrad": "mrad",
    "mm": "mm", "um": "um", "rev": "rev", "ma": "mA", "kn": "kN", "arms": "Arms", "pct": "%", "percent": "%",
    "counts": "counts", "cts": "counts", "cnt": "counts", "inc": "inc", "lsb": "LSB", "m": "m", "n": "N", "a": "A",
    "mg": "mg",
}  # fmt: skip
"""Last word of a name, without capitals, and the unit that it is."""
_DIVIDED = frozenset(("s", "s2", "s^2", "s²", "min"))


def kind_by_name(name: str) -> QuantityKind | None:
    """The kind of quantity that a name says; None if it says none, or more than one.

    >>> [kind_by_name(name) for name in ("Solldrehmoment", "Actual speed", "转矩", "iq_inject", "u", "torque at speed")]
    ['torque', 'velocity', 'torque', 'current', None, None]
    """
    kinds = [kind for kind, words in _NAMES.items() if words.search(name.casefold())]
    return kinds[0] if len(kinds) == 1 else None


def unit_by_name(name: str) -> str:
    """The unit at the end of a name; empty if there is none, or the name says another kind of quantity.

    A single letter is a unit only if the name says what it measures: `axis_A` is not a current.

    >>> [unit_by_name(name) for name in ("speed_rpm", "TorqueNm", "velocity_rad_s", "iq_A", "axis_A", "load pct")]
    ['rpm', 'N m', 'rad/s', 'A', '', '%']
    """
    first, *words = _WORDS.split(name.strip())
    if not words or "temp" in name.casefold():
        return ""
    stem = [first, *words]
    if len(words) > 1 and words[-1].casefold() in _DIVIDED and read_unit(f"{words[-2]}/{words[-1]}").si:
        unit, stem = f"{words[-2]}/{words[-1]}", stem[:-2]
    elif words[-2:] == ["N", "m"]:
        unit, stem = "N m", stem[:-2]
    elif unit := _SUFFIXES.get(words[-1].casefold(), ""):
        stem = stem[:-1]
    kind, said = read_unit(unit).kind, kind_by_name("_".join(stem))
    if kind == "other" or said == kind:
        return unit
    return "" if said or (len(words[-1]) == 1 and unit == words[-1].upper()) or len(unit) == 1 else unit


@dataclass(frozen=True)
class DeclaredQuantities:
    """What the configuration declares of some channels, by name, before their names and units in the source.

    Parameters
    ----------
    kinds
        Kind of quantity.
    units
        Quantity of one unit of the samples: "rpm", "0.024 N m" (1 % of a rated torque of 2.4 N m), "1/131072 rev".

    Raises
    ------
    UsageError
        If a unit has a number and is not recognised.

    Examples
    --------
    >>> DeclaredQuantities(units={"load": "0.024 N m"}).channel("load", "%")
    Channel(name='load', unit='N m', kind='torque')
    >>> DeclaredQuantities().channel("Istdrehzahl", "1/min").factor, DeclaredQuantities().channel("Actual torque", "%")
    (0.10471975511965977, Channel(name='Actual torque', unit='%', kind='torque'))
    """

    kinds: Mapping[str, QuantityKind] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, unit in self.units.items():
            if not read_quantity(unit).si and re.search(r"\d", unit):
                raise UsageError(
                    "unreadable",
                    f"units of {name!r}: {unit!r} is not a quantity of which a unit is recognised",
                    "write what one unit of the channel is, such as '0.024 N m', '1/131072 rev' or 'rpm'",
                    argument="units",
                    channel=name,
                    value=unit,
                )

    @property
    def names(self) -> list[str]:
        """The channels of which something is declared, each once."""
        return list(dict.fromkeys([*self.kinds, *self.units]))

    def renamed(self, names: Mapping[str, str]) -> DeclaredQuantities:
        """The same of channels with other names."""
        kinds = {names.get(name, name): kind for name, kind in self.kinds.items()}
        return DeclaredQuantities(kinds, {names.get(name, name): unit for name, unit in self.units.items()})

    def channel(self, name: str, unit: str, of: str | None = None) -> Channel:
        """The channel `name` whose unit in the source is `unit`: with its SI unit, if that is recognised.

        `of` is the name in the source, where it is another.
        """
        return _channel(name, of or name, unit, self.kinds.get(of or name), self.units.get(of or name))

    def of(self, channels: Sequence[Channel]) -> tuple[Channel, ...]:
        """Channels with the units of a sender, in SI units."""
        return tuple(self.channel(channel.name, channel.unit) for channel in channels)


def in_si(data: NDArray[Any], channels: Sequence[Channel]) -> NDArray[Any]:
    """Samples of these channels in the units of their source, shape (channels, …), in those of the channels."""
    factors = np.array([channel.factor for channel in channels])
    return data if np.all(factors == 1) else data * factors.reshape(-1, *[1] * (data.ndim - 1))


@lru_cache(maxsize=4096)
def _channel(name: str, source_name: str, unit: str, declared: QuantityKind | None, given: str | None) -> Channel:
    written = unit or unit_by_name(source_name)
    reading = read_unit(written) if given is None else read_quantity(given)
    if not reading.si or declared not in (None, reading.kind):
        unit = written if given is None else given
        kind = declared or (kind_by_name(source_name) if not reading.si else None) or reading.kind
        return Channel(name, unit, kind, written if written != unit else "")
    written = written or given or ""
    return Channel(name, reading.si, reading.kind, written if written != reading.si else "", reading.factor)
