"""Expressions of the subset as Python text, with their types and the LREAL operations in them."""

from __future__ import annotations

import re
from typing import NamedTuple

from blark import transform as tf

from tools.structured_text import types
from tools.structured_text.types import ANY_INT, BOOL, LREAL, SCALARS, Array, Kind, Named, RefusedError, Scalar

COMPARED = {"<": "<", ">": ">", "<=": "<=", ">=": ">=", "=": "==", "<>": "!="}
RUNTIME = {name: getattr(types, name) for name in ("at", "quotient", "remainder", "divided", "to_lreal")}
RUNTIME |= {f"fit_{name}": kind.fit for name, kind in SCALARS.items() if kind.integer}
RUNTIME |= {f"type_{name}": kind for name, kind in SCALARS.items() if kind.integer}


def handler(node: object) -> str:
    """The method for a node of blark's tree: _if_statement for an IfStatement."""
    return "_" + re.sub(r"(?<=[a-z])(?=[A-Z])", "_", type(node).__name__).lower()


class Typed(NamedTuple):
    """Python text, its type, and how many LREAL operations it does; a literal's value where it is an integer."""

    text: str
    kind: Kind
    operations: int = 0
    literal: int | None = None


class Scope:
    """The variables of one POU: their types, and those of the structures' members and blocks' outputs in it."""

    def __init__(self, variables: dict[str, Kind], members: dict[str, dict[str, Kind]], functions: dict[str, Kind]):
        self.variables, self.members, self.functions = variables, members, functions

    def expression(self, node: object) -> Typed:
        name = type(node).__name__
        found = getattr(self, handler(node), None)
        if found is None:
            raise RefusedError(f"{name} is not in the subset")
        return found(node)

    def place(self, node: object) -> Typed:
        """A variable, an element of an array or a member: something that can be read, and maybe assigned."""
        if isinstance(node, tf.SimpleVariable):
            return self._simple_variable(node)
        if isinstance(node, tf.MultiElementVariable):
            return self._multi_element_variable(node)
        raise RefusedError(f"{type(node).__name__} is no variable")

    def _simple_variable(self, node: tf.SimpleVariable) -> Typed:
        name = str(node.name).lower()
        if name in ("true", "false"):
            return Typed(name.capitalize(), BOOL)
        if name not in self.variables:
            raise RefusedError(f"{node.name} is not declared")
        return Typed(f"v_{name}", self.variables[name])

    def _multi_element_variable(self, node: tf.MultiElementVariable) -> Typed:
        found = self._simple_variable(node.name)
        for element in node.elements:
            if isinstance(element, tf.FieldSelector):
                found = self._member(found, str(element.field.name).lower())
            elif isinstance(element, tf.SubscriptList):
                found = self._element(found, element.subscripts)
            else:
                raise RefusedError(f"{type(element).__name__} is not in the subset")
        return found

    def _member(self, of: Typed, name: str) -> Typed:
        if not isinstance(of.kind, Named) or name not in self.members[of.kind.name]:
            raise RefusedError(f"{of.text} has no {name} that can be read from here")
        return Typed(f"{of.text}.v_{name}", self.members[of.kind.name][name])

    def _element(self, of: Typed, subscripts: list) -> Typed:
        if not isinstance(of.kind, Array) or len(subscripts) != len(of.kind.lengths):
            raise RefusedError(f"{of.text} is not subscripted so")
        parts = []
        for subscript, length in zip(subscripts, of.kind.lengths):
            index = self.expression(subscript)
            if not isinstance(index.kind, Scalar) or not index.kind.integer:
                raise RefusedError(f"a subscript of {of.text} is no integer")
            parts.append(subscripted(index, length))
        # The last index runs fastest.
        place = parts[0] if len(parts) == 1 else f"({parts[0]}) * {of.kind.lengths[1]} + ({parts[1]})"
        return Typed(f"{of.text}[{place}]", of.kind.of)

    def _integer(self, node: tf.Integer, base: int = 10) -> Typed:
        value = int(str(node.value), base)
        kind = ANY_INT if node.type_name is None else SCALARS[str(node.type_name)]
        return Typed(str(kind.fit(value)), kind, 0, value)

    def _hex_integer(self, node: tf.HexInteger) -> Typed:
        return self._integer(node, 16)

    def _real(self, node: tf.Real) -> Typed:
        return Typed(repr(float(str(node.value))), LREAL)

    def _boolean(self, node: tf.Boolean) -> Typed:
        return Typed(str(node.value).capitalize(), BOOL)

    def _parenthesized_expression(self, node: tf.ParenthesizedExpression) -> Typed:
        inner = self.expression(node.expr)
        return inner._replace(text=f"({inner.text})")

    def _unary_operation(self, node: tf.UnaryOperation) -> Typed:
        inner, sign = self.expression(node.expr), str(node.op).upper()
        if sign == "NOT" and inner.kind is BOOL:
            return Typed(f"(not {inner.text})", BOOL, inner.operations)
        if sign == "-" and inner.kind is LREAL:
            return Typed(f"(-{inner.text})", LREAL, inner.operations + 1)
        raise RefusedError(f"{sign} {inner.kind} is not in the subset")

    def _binary_operation(self, node: tf.BinaryOperation) -> Typed:
        left, right, sign = self.expression(node.left), self.expression(node.right), str(node.op).upper()
        kind = common(left, right, sign)
        operations = left.operations + right.operations + (kind is LREAL)
        if sign in COMPARED:
            if sign in ("=", "<>") and kind is LREAL:
                raise RefusedError("LREAL compared for equality")
            return Typed(f"({left.text} {COMPARED[sign]} {right.text})", BOOL, operations)
        if sign in ("AND", "OR") and kind is BOOL:  # both sides are evaluated, as on most controllers
            return Typed(f"({left.text} {'&' if sign == 'AND' else '|'} {right.text})", BOOL, operations)
        if kind is LREAL and sign in ("+", "-", "*"):
            return Typed(f"({left.text} {sign} {right.text})", LREAL, operations)
        if kind is LREAL and sign == "/":
            return Typed(f"divided({left.text}, {right.text})", LREAL, operations)
        if kind.integer and sign in ("+", "-", "*"):
            return Typed(f"fit_{kind.name}({left.text} {sign} {right.text})", kind, operations)
        if kind.integer and sign in ("/", "MOD"):
            how = "quotient" if sign == "/" else "remainder"
            return Typed(f"{how}(type_{kind.name}, {left.text}, {right.text})", kind, operations)
        raise RefusedError(f"{left.kind} {sign} {right.kind} is not in the subset")

    def _function_call(self, node: tf.FunctionCall) -> Typed:
        name = str(node.name.name).upper()
        given = [self.expression(p.value) for p in node.parameters or []]
        operations = sum(g.operations for g in given)
        if name in self.functions and not given:
            return Typed(f"f_{name}()", self.functions[name])
        if name == "ABS" and [g.kind for g in given] == [LREAL]:
            return Typed(f"abs({given[0].text})", LREAL, operations + 1)
        source, _, target = name.partition("_TO_")
        if len(given) == 1 and source in SCALARS and given[0].kind is SCALARS[source]:
            if target == "LREAL":
                return Typed(f"to_lreal({given[0].text})", LREAL, operations)
            if target in SCALARS and SCALARS[target].integer and SCALARS[source].integer:
                return Typed(f"fit_{target}({given[0].text})", SCALARS[target], operations)
        raise RefusedError(f"{name}({', '.join(str(g.kind) for g in given)}) is not in the subset")


def subscripted(index: Typed, length: int) -> str:
    """Text of a subscript that is held to its bounds; a call costs several times the comparison of a plain variable."""
    if index.literal is not None and 0 <= index.literal < length:
        return index.text
    checked = f"at({index.text}, {length})"
    plain = re.fullmatch(r"v_\w+", index.text)
    return f"{index.text} if 0 <= {index.text} < {length} else {checked}" if plain else checked


def common(left: Typed, right: Typed, sign: str) -> Scalar:
    """The type that both sides have; an integer literal takes that of the other side, where it fits."""
    for one, other in ((left, right), (right, left)):
        if one.kind is ANY_INT and isinstance(other.kind, Scalar) and other.kind.integer and other.kind is not ANY_INT:
            other.kind.fit(one.literal)
            return other.kind
    if left.kind != right.kind or not isinstance(left.kind, Scalar) or left.kind is ANY_INT:
        raise RefusedError(f"{left.text} {sign} {right.text} mixes {left.kind} and {right.kind}")
    return left.kind


def assignable(value: Typed, kind: Kind) -> None:
    if value.kind is ANY_INT and isinstance(kind, Scalar) and kind.integer:
        kind.fit(value.literal)
    elif value.kind != kind:
        raise RefusedError(f"{value.text} of {value.kind} is assigned to {kind}")
