"""Options from the keys of configuration sections: type, limits, default and description are those of the key.

The sections are read as text, as the stubs of faces are: importing them loads pydantic, which would double the time of
`livebode run --help`.
"""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Callable, Mapping
from functools import cache, wraps
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import typer

from livebode.configuration import documented

_SECTIONS = {
    "fit": "livebode.configuration.fit_section:FitSection",
    "lines": "livebode.configuration.measurement_sections:LinesSection",
    "monitoring": "livebode.configuration.machine_sections:MonitoringSection",
    "report": "livebode.configuration.report_section:ReportSection",
    "serve": "livebode.configuration.output_sections:ServeSection",
    "signals": "livebode.configuration.measurement_sections:SignalsSection",
    "source": "livebode.sources.live.settings:SourceKeys",
    "tracking": "livebode.configuration.measurement_sections:TrackingSection",
}
_LIMITS = {"gt": "x>{}", "ge": "x>={}", "lt": "x<{}", "le": "x<={}"}
_TYPES = {"bool": bool, "Path": Path, "File": Path, "int": int, "float": float, "Positive": float}


class SectionKey(NamedTuple):
    """A key of a section: type of its option, help and default, which is None where the key is not set."""

    type: Any
    help: str
    default: Any


def key_help(key: str) -> str:
    """Help of an option that sets a key, such as "source.rate_hz".

    >>> key_help("lines.window")
    'Length of the window in samples. "auto": the measured period of the excitation. \\\\[default: auto; x>=3]'
    """
    section, _, name = key.partition(".")
    return _keys(section)[name].help


def with_keys(**sections: Mapping[str, tuple[str, str]]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """A command with options in place of its parameter `sections`, which receives the keys that were specified.

    Parameters
    ----------
    sections
        For each section its keys, with the option of each and its metavar: `tracking={"hop": ("--hop", "SAMPLES")}`.
        The command receives them as `{"tracking": {"hop": 20}}`.
    """
    options = {_parameter(s, key, *names): (s, key) for s, keys in sections.items() for key, names in keys.items()}

    def decorated(command: Callable[..., Any]) -> Callable[..., Any]:
        signature = inspect.signature(command, eval_str=True)
        parameters: list[inspect.Parameter] = []
        for name, parameter in signature.parameters.items():
            parameters += options if name == "sections" else [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)]

        @wraps(command)
        def collecting(**given: Any) -> Any:
            specified: dict[str, dict[str, Any]] = {}
            for parameter, (section, key) in options.items():
                if (value := given.pop(parameter.name)) not in (None, []):
                    specified.setdefault(section, {})[key] = value
            return command(sections=specified, **given)

        collecting.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
        collecting.__annotations__ = {one.name: one.annotation for one in parameters}
        return collecting

    return decorated


def _parameter(section: str, key: str, option: str, metavar: str) -> inspect.Parameter:
    found = _keys(section)[key]
    negated = "no-" + option[2:]
    names = f"{option}/--{negated}" if found.type is bool else option
    default = typer.Option(None, names, metavar=metavar or None, help=found.help)
    name = option[2:].replace("-", "_") + "_" * (option == "--from")
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=found.type | None)


@cache
def _keys(section: str) -> dict[str, SectionKey]:
    """Keys of a section by name."""
    module, _, name = _SECTIONS[section].partition(":")
    spec = find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    text = re.search(
        rf"^class {name}\b.*?(?=^\S|\Z)", Path(spec.origin).read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
    )
    assert text is not None
    (declared,) = ast.parse(text[0]).body
    assert isinstance(declared, ast.ClassDef)
    texts = documented(ast.get_docstring(declared) or "")
    fields = [node for node in declared.body if isinstance(node, ast.AnnAssign)]
    return dict(_key(field, texts) for field in fields if isinstance(field.target, ast.Name))


def _key(field: ast.AnnAssign, texts: Mapping[str, str]) -> tuple[str, SectionKey]:
    values = {word.arg: word.value for word in getattr(field.value, "keywords", ())}
    alias = values.get("alias")
    name = ast.literal_eval(alias) if alias is not None else ast.unparse(field.target)
    default = values.get("default") if isinstance(field.value, ast.Call) else field.value
    plain = None if default is None else ast.literal_eval(default)
    text, _, described = texts[name].replace(", relative to this file", "").partition(" Default: ")
    shown = "" if plain in (None, False, "", [], {}) else f"default: {plain}"
    about = [(described.rstrip(".") and f"default: {described.rstrip('.')}") or shown, *_limits(field.annotation)]
    notes = f" [{'; '.join(filter(None, about))}]" if any(about) else ""
    kind = _type(field.annotation)
    if kind == list[str]:
        text = f"{text.rstrip('.')}; repeat for several."
    return name, SectionKey(kind, (text + notes).replace("[", "\\["), plain)


def _type(annotation: ast.expr) -> Any:
    """Type of the option: of a choice and of several types text, which the section validates."""
    names = {node.id for node in ast.walk(annotation) if isinstance(node, ast.Name)}
    if "list" in names:
        return list[str]
    return str if names & {"Literal", "str"} else next((kind for n, kind in _TYPES.items() if n in names), str)


def _limits(annotation: ast.expr) -> list[str]:
    """Limits that the annotation states as numbers, as Typer writes them."""
    words = [word for node in ast.walk(annotation) if isinstance(node, ast.Call) for word in node.keywords]
    bounds = [(word.arg, word.value) for word in words if word.arg in _LIMITS and isinstance(word.value, ast.Constant)]
    own = [_LIMITS[str(name)].format(bound.value) for name, bound in bounds]
    return own or ["x>0"] * any(isinstance(node, ast.Name) and node.id == "Positive" for node in ast.walk(annotation))
