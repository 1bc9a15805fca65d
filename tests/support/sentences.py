"""The sentences in the source of the package: where errors are made, and literal texts."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

from livebode.core import LivebodeError

ROOT = Path(__file__).parents[2]
KINDS = {kind.__name__: kind for kind in LivebodeError.__subclasses__()}
SOURCE = ROOT / "src/livebode"
ADVISES = re.compile(r"\blivebode [a-z]|(?<![\w-])--[a-z]")
"""Names a command or an option."""


@cache
def trees() -> dict[Path, tuple[str, ast.Module]]:
    """Text and syntax tree of every module of the package."""
    paths = [*(ROOT / "src").rglob("*.py"), *ROOT.glob("wings/*/src/**/*.py")]
    texts = {path: path.read_text() for path in sorted(paths)}
    return {path: (text, ast.parse(text)) for path, text in texts.items()}


@cache
def made() -> list[tuple[str, str, ast.Call]]:
    """Where in the package an error is made: file and line, name of its class, and the call."""
    return [
        (f"{path.relative_to(ROOT)}:{node.lineno}", node.func.id, node)
        for path, (text, tree) in trees().items()
        if any(kind in text for kind in KINDS)
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in KINDS
    ]


@cache
def literals() -> tuple[tuple[Path, int, str], ...]:
    """The texts of the package that are not docstrings, with {} for what is filled in: file, line, text."""
    found = []
    for path, (source, tree) in trees().items():
        if not ADVISES.search(source):
            continue
        nodes = list(ast.walk(tree))
        # Docstrings, also of constants, and the parts of a text that is composed.
        left_out = {node.value for node in nodes if isinstance(node, ast.Expr)}
        left_out |= {value for node in nodes if isinstance(node, ast.JoinedStr) for value in node.values}
        texts = [(node, text) for node in nodes if node not in left_out and (text := text_of(node))]
        place = path.relative_to(SOURCE if path.is_relative_to(SOURCE) else ROOT)
        found += [(place, getattr(node, "lineno", 0), text) for node, text in texts]
    return tuple(found)


@cache
def templates() -> list[str]:
    """The templates of the package's messages."""
    return [
        text
        for source, tree in trees().values()
        if "Message(" in source
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Message" and (text := text_of(node.args[0]))
    ]


def text_of(node: ast.AST) -> str:
    if isinstance(node, ast.JoinedStr):
        return "".join(value.value if isinstance(value, ast.Constant) else "{}" for value in node.values)  # type: ignore[misc]
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""
