"""Statements of the subset as lines of Python."""

from __future__ import annotations

from blark import transform as tf

from tools.structured_text.expressions import Scope, Typed, assignable, handler
from tools.structured_text.types import BOOL, Array, Named, RefusedError, Scalar


class Body:
    """The Python text of one POU's statements."""

    def __init__(self, scope: Scope, inputs: dict[str, dict[str, str]]) -> None:
        self._scope, self._inputs, self._controls = scope, inputs, []
        self.lines: list[str] = []
        self._indent = 1

    def add(self, text: str) -> None:
        self.lines.append("    " * self._indent + text)

    def block(self, statements: tf.StatementList | None) -> None:
        self._indent += 1
        self.add("pass")
        for statement in statements.statements if statements else ():
            self.statement(statement)
        self._indent -= 1

    def statement(self, node: object) -> None:
        found = getattr(self, handler(node), None)
        if found is None:
            raise RefusedError(f"{type(node).__name__} is not in the subset")
        found(node)

    def _count(self, *values: Typed) -> None:
        if operations := sum(v.operations for v in values):
            self.add(f"operations += {operations}")

    def _assignment_statement(self, node: tf.AssignmentStatement) -> None:
        if len(node.variables) != 1:
            raise RefusedError("more than one variable is assigned to at once")
        target, value = self._scope.place(node.variables[0]), self._scope.expression(node.expression)
        if target.text in self._controls:
            raise RefusedError(f"{target.text} controls a loop and is assigned to")
        if not isinstance(target.kind, Scalar):
            raise RefusedError(f"{target.text} is assigned to as a whole")
        assignable(value, target.kind)
        self._count(value, target)
        self.add(f"{target.text} = {value.text}")

    def _if_statement(self, node: tf.IfStatement) -> None:
        arms = [(node.if_expression, node.statements), *((e.if_expression, e.statements) for e in node.else_ifs)]
        for depth, (expression, statements) in enumerate(arms):
            condition = self._scope.expression(expression)
            if condition.kind is not BOOL:
                raise RefusedError(f"{condition.text} is no condition")
            self._count(condition)
            self.add(f"if {condition.text}:")
            self.block(statements)
            self.add("else:")
            self._indent += 1
            if depth == len(arms) - 1:
                self.add("pass")
        self._indent -= 1
        self.block(node.else_clause.statements if node.else_clause else None)
        self._indent -= len(arms) - 1

    def _case_statement(self, node: tf.CaseStatement) -> None:
        selector = self._scope.expression(node.expression)
        if not isinstance(selector.kind, Scalar) or not selector.kind.integer:
            raise RefusedError(f"{selector.text} selects a case and is no integer")
        seen: set[int] = set()
        self.add(f"selected = {selector.text}")
        self.add("if False:")
        self.block(None)
        for case in node.cases:
            values = [self._scope.expression(match).literal for match in case.matches]
            if None in values or seen & set(values):
                raise RefusedError(f"the case {values} is no new integer")
            seen |= set(values)
            self.add(f"elif selected in {tuple(values)}:")
            self.block(case.statements)
        self.add("else:")
        self.block(node.else_clause.statements if node.else_clause else None)

    def _for_statement(self, node: tf.ForStatement) -> None:
        control = self._scope.place(node.control)
        limits = [self._scope.expression(end) for end in (node.from_, node.to)]
        if node.step is not None or not isinstance(control.kind, Scalar) or not control.kind.integer:
            raise RefusedError("a loop has a step, or its control is no integer")
        for limit in limits:
            assignable(limit, control.kind)
        name = control.text
        self.add(f"for {name} in range({limits[0].text}, {limits[1].text} + 1):")
        self._controls.append(name)
        self.block(node.statements)
        self._controls.pop()
        self.add(f"{name} = fit_{control.kind.name}({limits[1].text} + 1)")

    def _return_statement(self, _: tf.ReturnStatement) -> None:
        self.add("raise ReturnNow")

    def _function_call_statement(self, node: tf.FunctionCallStatement) -> None:
        called = self._scope.place(node.name)
        if not isinstance(called.kind, Named) or called.kind.name not in self._inputs:
            raise RefusedError(f"{called.text} is no function block")
        inputs = dict(self._inputs[called.kind.name])
        self.add(f"called = {called.text}")
        for parameter in node.parameters or []:
            if not isinstance(parameter, tf.InputParameterAssignment) or parameter.name is None:
                raise RefusedError(f"an argument of {called.text} is no input by its name")
            name = str(parameter.name.name).lower()
            if name not in inputs:
                raise RefusedError(f"{called.text} has no input {name}, or it is given twice")
            value = self._scope.expression(parameter.value)
            kind, _ = inputs.pop(name)
            if isinstance(kind, Array):
                raise RefusedError(f"the array {name} is handed over")
            assignable(value, kind)
            self._count(value)
            self.add(f"called.v_{name} = {value.text}")
        if left := [name for name, (_, required) in inputs.items() if required]:
            raise RefusedError(f"{called.text} is called without its {left}")
        self.add("operations += called.run()")
