"""`make mutations`: break lines at random, one at a time, and see whether a test notices.

`python -m tools.mutations PACKAGE COUNT SEED` (such as `livebode.records`, a wing, or `livebode` for the hull) chooses
comparisons, sums, products, numbers, choices and calls in functions, and changes each in the file of its module, which
is put back afterwards: commit first. The tests that concern the module (`tools.changed_tests`) run until one fails,
those of its package first. A survivor is printed with its line: either a test is missing, or the line is not needed.
"""

from __future__ import annotations

import ast
import random
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass

from tools.changed_tests import ROOT, concerned, modules, tested

_INSTEAD: dict[type[ast.AST], str] = {
    ast.Lt: ">=", ast.GtE: "<", ast.Gt: "<=", ast.LtE: ">", ast.Eq: "!=", ast.NotEq: "==", ast.Is: "is not",
    ast.IsNot: "is", ast.In: "not in", ast.NotIn: "in", ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*",
}  # fmt: skip


@dataclass(frozen=True)
class Mutation:
    """A change of one piece of a module's text."""

    module: str
    line: int
    begin: int
    end: int
    text: str


def mutations(module: str) -> Iterator[Mutation]:
    """Every change of a module that may be tried."""
    source = modules()[module].read_text(encoding="utf-8")
    # Places in the syntax tree count bytes.
    starts = [0]
    for line in source.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    for function in ast.walk(ast.parse(source)):
        for statement in function.body if isinstance(function, ast.FunctionDef) else ():
            for node in _outside_strings(statement):
                if isinstance(node, ast.expr | ast.stmt) and (text := _instead(node)) is not None:
                    begin = starts[node.lineno - 1] + node.col_offset
                    end = starts[(node.end_lineno or node.lineno) - 1] + (node.end_col_offset or 0)
                    yield Mutation(module, node.lineno, begin, end, text)


def _outside_strings(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes below, without those in f-strings, whose places Python 3.11 does not know, and inner functions."""
    yield node
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.JoinedStr | ast.FunctionDef):
            yield from _outside_strings(child)


def _instead(node: ast.AST) -> str | None:
    if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _INSTEAD:
        return f"({ast.unparse(node.left)} {_INSTEAD[type(node.ops[0])]} {ast.unparse(node.comparators[0])})"
    if isinstance(node, ast.BinOp) and type(node.op) in _INSTEAD:
        return f"({ast.unparse(node.left)} {_INSTEAD[type(node.op)]} {ast.unparse(node.right)})"
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return f"({node.value!r} + 1)"
    if isinstance(node, ast.IfExp):
        return f"({ast.unparse(node.orelse)} if {ast.unparse(node.test)} else {ast.unparse(node.body)})"
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        return "pass"
    return None


def noticed(mutation: Mutation) -> bool:
    """Whether a test fails with this mutation."""
    path = modules()[mutation.module]
    source = path.read_bytes()
    tests = [name for name in concerned({mutation.module}) if name.split(".")[-1].startswith("test_")]
    # Tests of the same package first: most mutations end there.
    tests.sort(key=lambda name: (not (mutation.module + ".").startswith(tested(name) or "-"), name))
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-x",
        "-p",
        "no:cacheprovider",
        *(str(modules()[name]) for name in tests),
    ]
    try:
        path.write_bytes(source[: mutation.begin] + mutation.text.encode() + source[mutation.end :])
        return subprocess.run(command, cwd=ROOT, capture_output=True, check=False).returncode == 1
    finally:
        path.write_bytes(source)


def main() -> None:
    """Try mutations, and print which survive."""
    package, count, seed = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    changed = subprocess.run(["git", "status", "--porcelain"], cwd=ROOT, capture_output=True, text=True, check=True)
    assert not changed.stdout, f"commit these first:\n{changed.stdout}"
    every = [one for name in sorted(modules()) if (name + ".").startswith(f"{package}.") for one in mutations(name)]
    survivors = 0
    for mutation in random.Random(seed).sample(every, count):
        if not noticed(mutation):
            survivors += 1
            print(f"survived: {modules()[mutation.module]}:{mutation.line}: {mutation.text}", flush=True)
    print(f"{package}: {count - survivors} of {count} noticed ({len(every)} possible, seed {seed})")


if __name__ == "__main__":
    main()
