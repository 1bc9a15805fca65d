"""The codes of errors: declared, raised, and listed in docs/reference/errors.md."""

from __future__ import annotations

import ast
import re

import pytest

from tests.support.sentences import KINDS, ROOT, made
from tools.error_codes import page

_WHOLE_COMMAND = re.compile(r"livebode [a-z]+( --[a-z-]+)+")  # says in Python, too, what it is


def texts(call: ast.Call) -> list[str]:
    """The literal texts in a call."""
    return [node.value for node in ast.walk(call) if isinstance(node, ast.Constant) and isinstance(node.value, str)]


def test_every_error_is_made_with_a_declared_code_and_a_message() -> None:
    for where, kind, call in made():
        code = call.args[0]
        assert isinstance(code, ast.Constant), f"{where}: the code is not a literal"
        assert code.value in KINDS[kind].codes, f"{where}: {code.value!r} is not declared in {kind}"
        assert len(call.args) in (2, 3), f"{where}: code, message, remedy; facts by name"


@pytest.mark.parametrize("kind", KINDS)
def test_every_declared_code_is_used_and_has_a_sentence(kind: str) -> None:
    used = {call.args[0].value for _, name, call in made() if name == kind}  # type: ignore[attr-defined]
    assert used == KINDS[kind].codes.keys()
    assert list(KINDS[kind].codes) == sorted(KINDS[kind].codes)
    assert all(text.endswith(".") and text[0].isupper() for text in KINDS[kind].codes.values())


def test_no_message_of_the_library_names_an_option_of_the_command_line() -> None:
    for where, _, call in made():
        texts = [
            node.value for node in ast.walk(call) if isinstance(node, ast.Constant) and isinstance(node.value, str)
        ]
        command = "/cli/" in where or "_command.py:" in where  # those of a wing are beside their work
        assert command or not any("--" in _WHOLE_COMMAND.sub("", text) for text in texts), where


def test_the_page_of_codes_is_what_the_classes_say() -> None:
    assert (ROOT / "docs" / "reference" / "errors.md").read_text() == page()
