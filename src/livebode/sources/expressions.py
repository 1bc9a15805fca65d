"""Channels that are computed from others: names, numbers, + - * /, a sign, parentheses, diff and unwrap; no more.

Its operands are in SI units where their units are recognised."""

from __future__ import annotations

import ast
import math
import re
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from livebode.arrays import Floats
from livebode.core import Block, Channel, QuantityKind, UsageError, read_unit
from livebode.dataclass import dataclass
from livebode.sources.units import split_unit
from livebode.sources.unwrapping import Unwrapping

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


TEXT_MAX, DEPTH_MAX = 200, 16
_QUOTED = re.compile("`([^`]*)`")
_STAND_IN = "quoted_{}_"


class ExpressionSyntaxError(ValueError):
    """The text is not in the grammar; the argument says why."""


@dataclass(frozen=True, eq=False)
class Expression:
    """A computed channel.

    Attributes
    ----------
    text
        As a person wrote it; also the name of the channel.
    names
        Names of the channels in it, each once.
    before
        Samples before the first computed one: how often it differentiates.
    unwraps
        Whether it has an unwrap(…).
    unit
        Unit behind it in brackets; empty if its unit follows from the channels.
    """

    text: str
    tree: ast.expr
    quoted: Mapping[str, str]
    names: tuple[str, ...]
    before: int
    unit: str = ""
    unwraps: bool = False

    def values(
        self, data: Mapping[str, Floats], rate_hz: float, turns: dict[int, Unwrapping] | None = None, repeated: int = 0
    ) -> Floats:
        """Its samples from those of its channels, shape (samples,); the first `before` ones are NaN.

        `turns` is what it remembers of the previous samples, of which the last `repeated` ones come again in the next
        ones; None where these are all samples.
        """
        by = _Arithmetic(rate_hz, {} if turns is None else turns, repeated)
        with np.errstate(all="ignore"):  # a division by 0 gives a sample that is not finite, as in a file
            found = _walk(self.tree, lambda node: data[_name(node, self.quoted)], by)
        return np.asarray(found, dtype=np.float64) * read_unit(self.unit).factor

    def channel(self, channels: Mapping[str, Channel]) -> Channel:
        """Its name, unit and kind, from those of its channels.

        Raises
        ------
        UsageError
            If it adds channels of different units without a factor between them.
        """

        def of(node: ast.expr) -> Quantity:
            return Quantity.of(channels[_name(node, self.quoted)])

        found = _walk(self.tree, of, _Units())
        if self.unit:
            reading = read_unit(self.unit)
            return Channel(self.text, reading.si or self.unit, written=self.unit if reading.si != self.unit else "")
        return Channel(self.text, found.unit, found.kind) if found.kind else Channel(self.text, found.unit)


def parse_expression(text: str) -> Expression:
    """The expression in a text.

    Names with other characters than letters, digits, points and _ are in backticks. The result may end with its unit.

    >>> parse_expression("pos + 0.35*`angle (rad)`").names, parse_expression("diff(x) [m/s]").unit
    (('pos', 'angle (rad)'), 'm/s')
    >>> parse_expression("unwrap(angle, 360) / 2").values({"angle": np.array([358.0, 2.0])}, 1000.0)
    array([179., 181.])

    Raises
    ------
    ExpressionSyntaxError
        If the text is too long, nested too deeply, or anything else is in it.
    """
    if len(text) > TEXT_MAX:
        raise ExpressionSyntaxError(f"it is longer than {TEXT_MAX} characters")
    bare, unit = split_unit(text) if text.endswith("]") else (text, "")
    quoted = {_STAND_IN.format(i): name for i, name in enumerate(dict.fromkeys(_QUOTED.findall(bare)))}
    stand_in = {name: key for key, name in quoted.items()}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(_QUOTED.sub(lambda match: f" {stand_in[match[1]]} ", bare).strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ExpressionSyntaxError("it is not of the form a - 0.5*b") from None
    names: dict[str, None] = {}
    before = _check(tree, quoted, names, 0)
    if not names:
        raise ExpressionSyntaxError("there is no channel in it")
    unwraps = any(isinstance(node, ast.Call) and _unwrapped(node) is not None for node in ast.walk(tree))
    return Expression(text, tree, quoted, tuple(names), before, unit, unwraps)


def negated(name: str) -> str:
    """The expression of a channel, or of an expression, with the other sign.

    >>> negated("enc1"), negated("-enc1"), negated("a + b"), negated("enc 1 (mm)")
    ('-enc1', 'enc1', '-(a + b)', '-`enc 1 (mm)`')
    """
    try:
        tree = parse_expression(name).tree
    except ExpressionSyntaxError:
        return f"-`{name}`"
    match tree:
        case ast.Name() | ast.Attribute():
            return f"-{name}"
        case ast.UnaryOp(op=ast.USub(), operand=ast.Name() | ast.Attribute()):
            return name.strip().removeprefix("-").strip()
    return f"-({name})"


def unwrapping_text(name: str, turn: float) -> str:
    """The expression of a channel that is unwrapped.

    >>> unwrapping_text("enc1", 65536.0), unwrapping_text("angle (deg)", 360.0)
    ('unwrap(enc1, 65536)', 'unwrap(`angle (deg)`, 360)')
    """
    number = f"{turn:.16g}"
    try:
        plain = isinstance(parse_expression(name).tree, ast.Name | ast.Attribute)
    except ExpressionSyntaxError:
        plain = False
    return f"unwrap({name if plain else f'`{name}`'}, {number})"


def _check(node: ast.expr, quoted: Mapping[str, str], names: dict[str, None], depth: int) -> int:
    """The number of samples that it needs before the first; collects the names."""
    if depth > DEPTH_MAX:
        raise ExpressionSyntaxError(f"it is nested more than {DEPTH_MAX} deep")
    match node:
        case ast.Name() | ast.Attribute():
            names.setdefault(_name(node, quoted))
            return 0
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            if not math.isfinite(_number(value)):
                raise ExpressionSyntaxError("a number in it is too large")
            return 0
        case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=inner):
            return _check(inner, quoted, names, depth + 1)
        case ast.BinOp(op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div(), left=left, right=right):
            return max(_check(part, quoted, names, depth + 1) for part in (left, right))
        case ast.Call(func=ast.Name(id="diff"), args=[inner], keywords=[]):
            return _check(inner, quoted, names, depth + 1) + 1
        case ast.Call() if (found := _unwrapped(node)) is not None:
            inner, turn = found
            if not (math.isfinite(turn) and turn > 0):
                raise ExpressionSyntaxError("the turn in unwrap(…) is not a positive number")
            return _check(inner, quoted, names, depth + 1)
    raise ExpressionSyntaxError(
        "only names, numbers, + - * /, diff(…) and unwrap(…, turn) are possible, and other names need backticks"
    )


def _unwrapped(node: ast.Call) -> tuple[ast.expr, float] | None:
    """What is unwrapped, and its turn; None for another call."""
    match node:
        case ast.Call(
            func=ast.Name(id="unwrap"), args=[inner, ast.Constant(value=int() | float() as turn)], keywords=[]
        ):
            return inner, _number(turn)
    return None


def _name(node: ast.expr, quoted: Mapping[str, str]) -> str:
    """A name, or names joined by points."""
    if isinstance(node, ast.Attribute):
        return f"{_name(node.value, {})}.{node.attr}"
    if not isinstance(node, ast.Name):
        raise ExpressionSyntaxError("names that are no words need backticks")
    return quoted.get(node.id, node.id)


def _number(value: float) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf


class _Arithmetic:
    """Operations on samples."""

    add, subtract, multiply, divide, negative = (
        staticmethod(f) for f in (np.add, np.subtract, np.multiply, np.divide, np.negative)
    )

    def __init__(self, rate_hz: float, turns: dict[int, Unwrapping], repeated: int) -> None:
        self._rate_hz, self._turns, self._repeated = rate_hz, turns, repeated

    def number(self, value: float) -> Any:
        return np.float64(value)

    def diff(self, x: Any) -> Any:
        return np.diff(x, prepend=np.nan) * self._rate_hz if np.ndim(x) else np.float64(0.0)

    def unwrap(self, x: Any, turn: float, node: int) -> Any:
        return self._turns.setdefault(node, Unwrapping(turn)).process(x, self._repeated) if np.ndim(x) else x


class _Units:
    """The same operations on quantities."""

    add, subtract, multiply, divide = (staticmethod(f) for f in (sum_of, sum_of, product, quotient))
    diff = staticmethod(derivative)

    def number(self, value: float) -> Any:
        return Quantity(number=value)

    def negative(self, x: Any) -> Any:
        return x

    def unwrap(self, x: Any, _turn: float, _node: int) -> Any:
        return x


def _walk(node: ast.expr, of_name: Callable[[ast.expr], Any], by: _Arithmetic | _Units) -> Any:
    match node:
        case ast.Constant(value=value):
            return by.number(float(value))  # type: ignore[arg-type]
        case ast.UnaryOp(op=op, operand=inner):
            x = _walk(inner, of_name, by)
            return by.negative(x) if isinstance(op, ast.USub) else x
        case ast.BinOp(op=op, left=left, right=right):
            operation = {ast.Add: by.add, ast.Sub: by.subtract, ast.Mult: by.multiply, ast.Div: by.divide}[type(op)]
            return operation(_walk(left, of_name, by), _walk(right, of_name, by))
        case ast.Call(args=[inner, ast.Constant(value=turn)]):
            return by.unwrap(_walk(inner, of_name, by), float(turn), id(node))  # type: ignore[arg-type]
        case ast.Call(args=[inner]):
            return by.diff(_walk(inner, of_name, by))
    return of_name(node)


def computed_blocks(
    blocks: Iterator[Block], names: Sequence[str], expressions: Mapping[str, Expression], labels: Sequence[Channel]
) -> Iterator[Block]:
    """Blocks of the channels `names`, of which `expressions` are computed from other channels of `blocks`.

    A difference is one of two samples: the first samples of the recording, and those behind a gap, are not in it.
    """
    before = max(expression.before for expression in expressions.values())
    held, stop = np.zeros((0, 0)), -1
    turns = {name: dict[int, Unwrapping]() for name in expressions}
    for block in blocks:
        follows = block.start == stop and not block.gap
        data = np.concatenate([held, block.data], axis=1) if follows and before else block.data
        signals = dict(zip(block.names, data))
        rows = [
            expressions[name].values(signals, block.rate_hz, turns[name], before)
            if name in expressions
            else signals[name]
            for name in names
        ]
        first = block.stop - data.shape[1] + before
        gap = block.gap if not follows else False
        if data.shape[1] > before:
            yield replace(block, data=np.array(rows)[:, before:], channels=tuple(labels), start=first, gap=gap)
        held, stop = data[:, max(data.shape[1] - before, 0) :], block.stop
