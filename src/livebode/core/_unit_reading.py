"""From the text of a unit to the kind of quantity that it measures: the only place where such a text decides."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import replace
from functools import lru_cache
from math import inf, pi
from typing import Literal, get_args

from livebode.dataclass import dataclass

QuantityKind = Literal["torque", "force", "current", "velocity", "position", "acceleration", "other"]
KINDS: tuple[QuantityKind, ...] = get_args(QuantityKind)

_TEXT_MAX = 64
_EXPONENT_MAX = 9
_Dimension = tuple[int, int, int, int, int]  # exponents of m, kg, s, A and of the angle

_NUMBER: _Dimension = (0, 0, 0, 0, 0)
_METRE: _Dimension = (1, 0, 0, 0, 0)
_SECOND: _Dimension = (0, 0, 1, 0, 0)
_AMPERE: _Dimension = (0, 0, 0, 1, 0)
_ANGLE: _Dimension = (0, 0, 0, 0, 1)
_NEWTON: _Dimension = (1, 1, -2, 0, 0)
_PER_SECOND: _Dimension = (0, 0, -1, 0, 0)
_PER_SECOND_SQUARED: _Dimension = (0, 0, -2, 0, 0)

_KIND_OF: dict[_Dimension, tuple[QuantityKind, str]] = {
    (2, 1, -2, 0, 0): ("torque", "N m"),
    _NEWTON: ("force", "N"),
    _AMPERE: ("current", "A"),
    _METRE: ("position", "m"),
    _ANGLE: ("position", "rad"),
    (1, 0, -1, 0, 0): ("velocity", "m/s"),
    (0, 0, -1, 0, 1): ("velocity", "rad/s"),
    _PER_SECOND: ("velocity", "rad/s"),
    (1, 0, -2, 0, 0): ("acceleration", "m/s²"),
    (0, 0, -2, 0, 1): ("acceleration", "rad/s²"),
    _PER_SECOND_SQUARED: ("acceleration", "rad/s²"),
}
"""Kind and SI unit."""
SI_UNITS = frozenset(si for _, si in _KIND_OF.values())
_PREFIXED = {"m": _METRE, "s": _SECOND, "A": _AMPERE, "N": _NEWTON, "rad": _ANGLE}
_PREFIXES = {"n": 1e-9, "u": 1e-6, "μ": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "k": 1e3, "M": 1e6}
_SYMBOLS: dict[str, tuple[float, _Dimension]] = {
    **{symbol: (1.0, dimension) for symbol, dimension in _PREFIXED.items()},
    **{p + s: (factor, dimension) for s, dimension in _PREFIXED.items() for p, factor in _PREFIXES.items()},
    **dict.fromkeys(("Arms", "Aeff", "Apk"), (1.0, _AMPERE)),
    **dict.fromkeys(("deg", "degree", "degrees", "°", "Grad", "度"), (pi / 180, _ANGLE)),
    "mdeg": (pi / 180e3, _ANGLE),
    **dict.fromkeys(("rev", "revs", "turn", "turns", "r", "U", "Umdr", "转", "圈"), (2 * pi, _ANGLE)),
    **dict.fromkeys(("rpm", "RPM", "Rpm", "upm", "UPM", "Upm"), (2 * pi / 60, (0, 0, -1, 0, 1))),
    **dict.fromkeys(("rps", "RPS"), (2 * pi, (0, 0, -1, 0, 1))),
    "弧度": (1.0, _ANGLE),
    "米": (1.0, _METRE),
    "毫米": (1e-3, _METRE),
    "安": (1.0, _AMPERE),
    "牛": (1.0, _NEWTON),
    "牛米": (1.0, (2, 1, -2, 0, 0)),
    "秒": (1.0, _SECOND),
    **dict.fromkeys(("分", "分钟"), (60.0, _SECOND)),
    "kg": (1.0, (0, 1, 0, 0, 0)),
    **dict.fromkeys(("g", "gn", "G"), (9.80665, (1, 0, -2, 0, 0))),  # of accelerometers; no other kind has g
    "mg": (9.80665e-3, (1, 0, -2, 0, 0)),
    "sec": (1.0, _SECOND),
    "min": (60.0, _SECOND),
    "h": (3600.0, _SECOND),
}
_TOKEN = re.compile(
    r"\s*(?:(?P<symbol>[^\W\d_]+|°)(?:(?:\^|\*\*)?(?P<exponent>[+-]?\d+|\([+-]?\d+\)))?|(?P<one>1)(?!\d)"
    r"|(?P<mark>[/()])|(?:[*·⋅∙.]|-(?!\d)))\s*"
)
_PER_MINUTE = re.compile(r"min|分")
_QUANTITY = re.compile(
    r"\s*(?P<number>\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)(?:\s*/\s*(?P<divisor>\d+(?:\.\d*)?))?\s*(?P<unit>\D.*)"
)
_TORQUE = re.compile(r"([kMmcμu]?N)([cm]?m)")  # "Nm" is one word in most headings


@dataclass(frozen=True)
class UnitReading:
    """The quantity that a unit measures.

    Attributes
    ----------
    kind
        Kind of the quantity; "other" for a unit that is not recognised, or that measures none of the other kinds.
    factor
        SI units (rad for angles) in one of this unit; 1 for a unit that is not recognised.
    rotary
        Whether it contains no length, except in a torque.
    si
        The SI unit of the quantity, in the spelling of livebode; empty for a unit that is not recognised.
    """

    kind: QuantityKind = "other"
    factor: float = 1.0
    rotary: bool = False
    si: str = ""


def read_unit(text: str) -> UnitReading:
    """What a unit measures, by its dimension; spellings of the same unit give the same.

    Recognised are products and quotients of m, kg, s, min, h, A, N, g, rad, °, deg, rev and rpm with SI prefixes, also
    in German and Chinese. The unit 1/s is that of an angular velocity; 1/min are revolutions per minute.

    >>> [read_unit(text).kind for text in ("N m", "rad s^-1", "mm/s²", "Arms", "1/min", "counts", "")]
    ['torque', 'velocity', 'acceleration', 'current', 'velocity', 'other', 'other']
    >>> read_unit("mNm")
    UnitReading(kind='torque', factor=0.001, rotary=True, si='N m')
    >>> [round(read_unit(text).factor, 4) for text in ("rpm", "1/min", "min⁻¹", "U/min", "转/分")]
    [0.1047, 0.1047, 0.1047, 0.1047, 0.1047]
    """
    return _read(text) if 0 < len(text) <= _TEXT_MAX else UnitReading()


def read_quantity(text: str) -> UnitReading:
    """What a number of a unit measures, with the number in the factor; a unit without a number is one of it.

    >>> read_quantity("0.024 N m"), read_quantity("1/131072 rev").si, read_quantity("rpm").si, read_quantity("3 %").si
    (UnitReading(kind='torque', factor=0.024, rotary=True, si='N m'), 'rad', 'rad/s', '')
    """
    if (reading := read_unit(text)).si or not (written := _QUANTITY.fullmatch(text)):
        return reading
    reading, number = read_unit(written["unit"]), float(written["number"])
    divisor = float(written["divisor"] or 1)
    factor = number / divisor * reading.factor if divisor else 0.0
    return replace(reading, factor=factor) if reading.si and 0 < factor < inf else UnitReading()


def split_plant_unit(text: str) -> tuple[str, str]:
    """The units of output and input in the unit of a plant, which is written as "output/(input)".

    >>> split_plant_unit("rad/s/(N m)"), split_plant_unit("m/(A)"), split_plant_unit("")
    (('rad/s', 'N m'), ('m', 'A'), ('', ''))
    """
    depth = 0
    for index in range(len(text) - 1, 0, -1):
        depth += (text[index] == ")") - (text[index] == "(")
        if depth <= 0:
            return (text[: index - 1], text[index + 1 : -1]) if text[index - 1] == "/" and text[-1] == ")" else ("", "")
    return "", ""


@lru_cache(maxsize=1024)
def _read(text: str) -> UnitReading:
    reading = _dimension(_tokens(unicodedata.normalize("NFKC", text).replace("−", "-").strip("[] ")))
    if reading is None:
        return UnitReading()
    factor, dimension = reading
    if dimension not in _KIND_OF:
        return UnitReading()
    kind, si = _KIND_OF[dimension]
    if dimension in (_PER_SECOND, _PER_SECOND_SQUARED) and _PER_MINUTE.search(text):
        factor *= 2 * pi  # revolutions per minute: nobody states an angle in radians per minute
    return UnitReading(kind, factor, kind == "torque" or dimension[0] == 0, si)


def _tokens(text: str) -> list[re.Match[str]] | None:
    """The words and marks of a text; None if there is anything else in it."""
    tokens, index = [], 0
    while index < len(text):
        match = _TOKEN.match(text, index)
        if match is None:
            return None
        tokens.append(match)
        index = match.end()
    return tokens


def _dimension(tokens: list[re.Match[str]] | None) -> tuple[float, _Dimension] | None:
    """Factor and dimension of a product; None if it is not one of known units."""
    factor, dimension = 1.0, list(_NUMBER)
    signs, sign = [1], 1  # of the open parentheses, and of the next word
    for token in tokens or ():
        if token["mark"] == "(":
            signs.append(signs[-1] * sign)
        elif token["mark"] == ")":
            signs.pop()
        elif token["symbol"]:
            known = _symbol(token["symbol"])
            exponent = int((token["exponent"] or "1").strip("()")) * sign * signs[-1]
            if known is None or abs(exponent) > _EXPONENT_MAX:
                return None
            factor *= known[0] ** exponent
            dimension = [d + exponent * k for d, k in zip(dimension, known[1])]
        if not signs:
            return None
        if token.group().strip():  # a space between "/" and its unit changes nothing
            sign = -1 if token["mark"] == "/" else 1
    m, kg, s, a, angle = dimension
    return (factor, (m, kg, s, a, angle)) if (len(signs), sign) == (1, 1) else None


def _symbol(text: str) -> tuple[float, _Dimension] | None:
    if (known := _SYMBOLS.get(text)) or not (torque := _TORQUE.fullmatch(text)):
        return known
    (force, newton), (length, metre) = (_SYMBOLS[part] for part in torque.groups())
    m, kg, s, a, angle = (f + d for f, d in zip(newton, metre))
    return force * length, (m, kg, s, a, angle)
