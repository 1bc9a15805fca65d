"""The evaluator of Structured Text: right where it computes, and strict where controllers differ."""

from __future__ import annotations

import pytest

from tools.structured_text import Machine, RefusedError
from tools.structured_text.types import ULINT

VARIABLES = (
    "a : LREAL; b : LREAL; n : UDINT; m : UDINT; i : DINT; big : ULINT; yes : BOOL; t : ARRAY [0..1, 0..2] OF LREAL;"
)


def ran(body: str, variables: str = VARIABLES, more: str = "", **given: object):
    """A program with this body after one cycle."""
    text = f"{more}PROGRAM P\nVAR\n{variables}\nEND_VAR\n{body}\nEND_PROGRAM\n"
    program = Machine(text, functions={"F_NOW": (ULINT, lambda: 7)}).instance("P")
    for name, value in given.items():
        program[name] = value
    program()
    return program


@pytest.mark.parametrize(
    ("body", "name", "value"),
    [
        ("a := 2.0 + 3.0 * 4.0;", "a", 14.0),
        ("a := 2.0 - 3.0 - 4.0;", "a", -5.0),
        ("a := 8.0 / 2.0 / 2.0;", "a", 2.0),
        ("a := -2.0 * 3.0 + 1.0;", "a", -5.0),
        ("a := 1.0 - 2.0 * (3.0 - 4.0 * 5.0);", "a", 35.0),
        ("m := 17; n := m / 5 + m MOD 5;", "n", 5),
        ("n := 16#1F;", "n", 31),
        ("i := 3; i := (i - 10) / 2;", "i", -3),
        ("i := 3; i := (i - 10) MOD 4;", "i", -3),
        ("yes := NOT (1.0 < 2.0) OR (n = 0) AND (m >= 0);", "yes", True),
        ("yes := n + 1 > 0 AND NOT (n <> m);", "yes", True),
        ("n := ULINT_TO_UDINT(F_NOW() MOD ULINT#4) + 1;", "n", 4),
        ("a := ABS(-3.0) + UDINT_TO_LREAL(n);", "a", 3.0),
        ("FOR n := 2 TO 4 DO a := a + 1.0; END_FOR", "a", 3.0),
        ("FOR n := 2 TO 4 DO a := a + 1.0; END_FOR", "n", 5),
        ("IF yes THEN n := 1; ELSIF n = 0 THEN n := 2; ELSE n := 3; END_IF", "n", 2),
        ("CASE n OF 0: m := 1; 1, 2: m := 2; ELSE m := 3; END_CASE", "m", 1),
        ("n := 2; CASE n OF 0: m := 1; 1, 2: m := 2; ELSE m := 3; END_CASE", "m", 2),
        ("n := 1; RETURN; n := 2;", "n", 1),
        ("t[1, 2] := 5.0; A := T[1, 2];", "a", 5.0),
    ],
)
def test_expressions_are_computed_as_on_a_controller(body: str, name: str, value: object) -> None:
    assert ran(body)[name] == value


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("n := n - 1;", "-1 overflows UDINT"),
        ("n := 4294967295; n := n + 1;", "4294967296 overflows UDINT"),
        ("n := 4294967296;", "overflows UDINT"),
        ("n := ULINT_TO_UDINT(big - 1);", "-1 overflows ULINT"),
        ("big := ULINT#18446744073709551615; a := ULINT_TO_LREAL(big);", "no LREAL of its own"),
        ("n := 1 / m;", "1 / 0"),
        ("n := n MOD m;", "0 MOD 0"),
        ("a := 1.0 / b;", "1.0 / 0.0"),
        ("n := 3; a := t[0, n];", "subscript 3 is not within 0..2"),
        ("a := t[0];", "not subscripted so"),
        ("a := n;", "is assigned to"),
        ("a := 1;", "is assigned to"),
        ("big := n;", "is assigned to"),
        ("a := a + 1;", "mixes"),
        ("n := n + i;", "mixes"),
        ("yes := a = b;", "equality"),
        ("yes := n AND m;", "not in the subset"),
        ("a := SQRT(b);", "not in the subset"),
        ("a := q;", "q is not declared"),
        ("FOR n := 0 TO 3 DO n := 1; END_FOR", "controls a loop"),
        ("FOR n := 0 TO 3 BY 2 DO a := 1.0; END_FOR", "has a step"),
        ("WHILE yes DO a := 1.0; END_WHILE", "not in the subset"),
        ("CASE n OF 0: m := 1; 0: m := 2; END_CASE", "no new integer"),
        ("yes := (n > 0) AND (t[0, n + 5] > 0.0);", "subscript 5"),
    ],
)
def test_code_that_controllers_run_differently_is_refused(body: str, message: str) -> None:
    with pytest.raises(RefusedError, match=message):
        ran(body)


BLOCK = """
FUNCTION_BLOCK FB
VAR_INPUT x : LREAL := 2.0; END_VAR
VAR_OUTPUT y : LREAL; END_VAR
VAR_IN_OUT r : S; END_VAR
VAR kept : LREAL; END_VAR
kept := kept + x;
y := kept;
r.n := r.n + 1;
END_FUNCTION_BLOCK
TYPE S : STRUCT n : UDINT; END_STRUCT END_TYPE
"""
USES = "f : FB; g : FB; s : S; a : LREAL; n : UDINT;"


def test_blocks_keep_their_own_memory_and_share_what_is_handed_over() -> None:
    program = ran("f(r := s, x := 3.0); f(r := s); g(r := s); a := f.y + 10.0 * g.y; n := s.n;", USES, BLOCK)
    assert (program["a"], program["n"]) == (3.0 + 3.0 + 10.0 * 2.0, 3)


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("f(x := 1.0);", "called without its"),
        ("f(r := s, z := 1.0);", "has no input z"),
        ("f(r := s, x := 1.0, x := 2.0);", "given twice"),
        ("f(r := s, x := n);", "is assigned to"),
        ("f(r := n);", "is assigned to"),
        ("a := f.kept;", "no kept that can be read"),
        ("a := f.x;", "no x that can be read"),
    ],
)
def test_calls_are_held_to_the_declaration(body: str, message: str) -> None:
    with pytest.raises(RefusedError, match=message):
        ran(body, USES, BLOCK)


@pytest.mark.parametrize(
    "variables",
    ["a : LREAL; A : LREAL;", "limit : LREAL;", "t : ARRAY [1..3] OF LREAL;", "a : STRING;", "n : UDINT := -1;"],
)
def test_declarations_are_held_to_the_subset(variables: str) -> None:
    with pytest.raises(RefusedError):
        ran("z := 1.0;", f"z : LREAL; {variables}")


def test_a_structure_with_a_gap_has_no_bytes() -> None:
    whole = Machine("TYPE S :\nSTRUCT\n    a : UDINT := 1;\n    b : UINT := 2;\n    c : UINT;\nEND_STRUCT\nEND_TYPE\n")
    assert whole.instance("S").bytes() == bytes([1, 0, 0, 0, 2, 0, 0, 0])
    gap = Machine("TYPE S :\nSTRUCT\n    a : UDINT;\n    b : LREAL;\nEND_STRUCT\nEND_TYPE\n")
    with pytest.raises(RefusedError, match="another packing"):
        gap.instance("S").bytes()


def test_operations_are_counted_where_they_are_done() -> None:
    program = Machine(
        "PROGRAM P\nVAR\n    a : LREAL; n : UDINT; yes : BOOL;\nEND_VAR\nIF yes THEN\n    a := a * 2.0 + 1.0;\nEND_IF\n"
        "FOR n := 0 TO 3 DO\n    a := a - 1.0;\nEND_FOR\nEND_PROGRAM\n"
    ).instance("P")
    assert program() == 4
    program["yes"] = True
    assert program() == 6
