"""Fields of the forms: what a command and its files know of their values, in the words of their help."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from livebode.plugins import loaded, named

_NOTE = re.compile(r"\s*\[default: (.*)\]$")
_DEFAULT = re.compile(r"(.*?)\s*Default: (.*?)\.?$", re.DOTALL)


class TaskField(NamedTuple):
    """A value that a person may give.

    Attributes
    ----------
    name
        Option of the command, or key of its file, as "limits.torque_n_m_max".
    help
        Its help or description.
    default
        What applies without a value, in words; empty if nothing does.
    kind
        "text", "number", "pair" (two numbers), "choice" or "flag".
    choices
        Values of a choice.
    """

    name: str
    help: str
    default: str = ""
    kind: str = "text"
    choices: tuple[str, ...] = ()


def option_fields(command: str, options: Sequence[str]) -> list[TaskField]:
    """The fields of options of an installed command.

    >>> option_fields("learn", ["--reason"])[0].help.partition(".")[0]
    'Why this baseline is learned'
    """
    import typer

    application = typer.Typer(add_completion=False)
    application.command()(loaded(named("commands")[command].function))
    known = {max(option.opts, key=len): option for option in _parameters(typer.main.get_command(application))}
    return [_option_field(name, known[name]) for name in options]


def _parameters(command: Any) -> list[Any]:
    return [parameter for parameter in command.params if parameter.param_type_name == "option"]


def _option_field(name: str, option: Any) -> TaskField:
    text, default = " ".join((option.help or "").replace("\\[", "[").split()), ""
    if (note := _NOTE.search(text)) is not None:
        text, default = text[: note.start()], note[1].partition("; ")[0]
    elif option.default not in (None, False):
        default = str(option.default)
    return TaskField(name, text, default, "flag" if option.is_flag else "text")


def key_fields(file: str, keys: Sequence[str]) -> list[TaskField]:
    """The fields of keys of a kind of TOML file, as "belt.drive.rate_hz", from its schema.

    >>> key_fields("axis", ["tracking.forgetting"])[0].default
    '0.8; 1 for the average of a recording'
    """
    schema = loaded(named("files")[file].schema)()
    return [_key_field(key, _described(schema, key)) for key in keys]


def _described(schema: Mapping[str, Any], key: str) -> dict[str, Any]:
    """The schema of a key."""
    part: dict[str, Any] = dict(schema)
    for word in key.split("."):
        part = part["properties"][word]
        parts = [part, part.get("items", {}), *part.get("anyOf", ())]
        if (reference := next((other["$ref"] for other in parts if "$ref" in other), None)) is not None:
            part = schema["$defs"][reference.rpartition("/")[2]] | {k: v for k, v in part.items() if k != "$ref"}
    return part


def _key_field(key: str, described: Mapping[str, Any]) -> TaskField:
    text, default = described.get("description", ""), described.get("default")
    if (found := _DEFAULT.fullmatch(text)) is not None:
        text, words = found[1], found[2]
    else:
        words = "" if default in (None, "") else f"{default:g}" if isinstance(default, int | float) else str(default)
    kinds = {"number": "number", "integer": "number", "array": "pair"}
    choices = tuple(map(str, described.get("enum", ())))
    return TaskField(key, text, words, "choice" if choices else kinds.get(described.get("type", ""), "text"), choices)


def toml_value(field: TaskField, text: str) -> Any:
    """What a text of a person is in a file: the command judges what is not a number.

    >>> toml_value(TaskField("limits.x", "", kind="number"), "1.5")
    1.5
    >>> toml_value(TaskField("measured.x", "", kind="pair"), "-1 : 2")
    [-1, 2]
    >>> toml_value(TaskField("limits.x", "", kind="number"), "1,5")
    '1,5'
    """
    if field.kind == "number":
        return _number(text)
    if field.kind == "pair":
        return [_number(part) for part in text.replace("…", ":").split(":")]
    return text


def _number(text: str) -> int | float | str:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text.strip()
