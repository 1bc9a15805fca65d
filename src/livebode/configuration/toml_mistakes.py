"""What people write instead of TOML, and the line that they mean."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

_AT_LINE = re.compile(r"\(at line (\d+), ")  # tomllib has no attribute for it before Python 3.14
_KEY = r"(\s*[A-Za-z0-9_.\"-]+\s*)"
_TRUTH = {"true": "true", "yes": "true", "on": "true", "false": "false", "no": "false", "off": "false"}
_ESCAPED = {"\t": r"\t", "\b": r"\b", "\f": r"\f", "\n": r"\n", "\r": r"\r", "\x1b": r"\e"}


def mistake_at(error: str, text: str) -> tuple[int, str] | None:
    """Number and text of the line that an error of tomllib is about; None if it names none.

    An error at the end of a line is about the beginning of the next one.
    """
    found = _AT_LINE.search(error)
    lines = text.splitlines()
    if found is None or not 0 < int(found[1]) <= len(lines):
        return None
    return int(found[1]), lines[int(found[1]) - 1].strip()


def meant_lines(line: str) -> Iterator[str]:
    """What was perhaps meant by a line that is not TOML, the more usual mistakes first."""
    colon = re.sub(rf"^{_KEY}:\s*", lambda found: f"{found[1].rstrip()} = ", line)
    for start in (line, colon):
        yield start
        for change in _CHANGES:
            yield change(start)


def without_thousands(line: str) -> str | None:
    """A line whose number has commas that may separate thousands, without them; None if it has none.

    >>> without_thousands("window = 4,000  # samples"), without_thousands("forgetting = 0,800")
    ('window = 4000  # samples', None)
    """
    meant, count = re.subn(
        r"(=\s*[+-]?[1-9]\d{0,2}(?:,\d{3})+)(?=\s*(#|$))", lambda found: found[1].replace(",", ""), line
    )
    return meant if count else None


def _changed(pattern: str, replacement: str | Callable[[re.Match[str]], str]) -> Callable[[str], str]:
    return lambda line: re.sub(pattern, replacement, line, flags=re.IGNORECASE)


_CHANGES = (
    _changed(r'"([^"]*\\[^"]*)"', r"'\1'"),
    _changed("[“”„«»]", '"'),
    _changed("[‘’‚]", "'"),
    _changed(r"^\s*(;|//)", "#"),
    lambda line: without_thousands(line) or line,
    _changed(r"(=\s*[+-]?\d+),(\d+)(?=\s*(#|$))", r"\1.\2"),
    _changed(rf"=\s*({'|'.join(_TRUTH)})(?=\s*(#|$))", lambda found: f"= {_TRUTH[found[1].lower()]}"),
    _changed(r"^(\s*\[[^\]#]*?)(\s*#.*)?$", lambda found: f"{found[1].rstrip()}]{found[2] or ''}"),
    _changed(r"=\s*([^\s\"'\[{#][^#\"']*?)\s*(#.*)?$", lambda found: f'= "{found[1]}"' + f" {found[2] or ''}".rstrip()),
    _changed(r"=\s*([\"'])((?:(?!\1).)*?)(\s+# (?:(?!\1).)*)?$", r"= \1\2\1\3"),
    _changed(r"=\s*([^\"]*)\"$", r'= "\1"'),
)
"""A path in double quotes, typographic quotes, a comment of another language, thousands, a decimal comma, a word of
another language, a bracket or quotes that are missing."""


def meant_value(expected: str, value: object) -> str | None:
    """How a value of the wrong type is written, by the type that pydantic expected; None if it is not such a value.

    >>> meant_value("int_type", "4000"), meant_value("float_type", "0,08"), meant_value("bool_type", "yes")
    ('4000', '0.08', 'true')
    >>> meant_value("int_type", 4.0), meant_value("string_type", [10, 20]), meant_value("string_type", 3)
    ('4', '"10,20"', '"3"')
    >>> meant_value("int_type", "many"), meant_value("float_type", "0.08 N m"), meant_value("string_type", True)
    (None, None, None)
    """
    kind = expected.partition("_")[0]
    match kind, value:
        case "bool", str():
            return _TRUTH.get(value.lower())
        case "bool", 0 | 1:
            return str(bool(value)).lower()
        case "int" | "float", str():
            number = value.strip().replace(",", ".")
            pattern = r"[+-]?\d+" if kind == "int" else r"[+-]?\d+(\.\d*)?(e[+-]?\d+)?"
            return number if re.fullmatch(pattern, number, re.ASCII) else None
        case "int", float() if value.is_integer():
            return str(int(value))
        case "string", list() if value and all(_is_number(part) for part in value):
            return f'"{",".join(map(str, value))}"'
        case "string", int() | float() if _is_number(value):
            return f'"{value}"'
    return None


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def meant_path(value: str) -> str | None:
    r"""A Windows path whose backslashes were read as escapes, as it was written; None if it is not one.

    >>> meant_path("C:" + chr(9) + "emp" + chr(8) + "ode.csv")
    'C:\\temp\\bode.csv'
    """
    if not any(letter in value for letter in _ESCAPED):
        return None
    written = "".join(_ESCAPED.get(letter, letter) for letter in value)
    return written if written.isprintable() and re.match(r"[A-Za-z]:|\\|\.", written) else None
