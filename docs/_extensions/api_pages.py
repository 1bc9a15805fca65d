"""Reference pages of the Python names, from the packages' `__all__` and the docstrings: one page per package.

A name that `livebode` itself offers is documented on its page, every other name on the page of the package that has it.
"""

from __future__ import annotations

import inspect
import pkgutil
import re
from importlib import import_module
from pathlib import Path
from types import GenericAlias, ModuleType

from sphinx.application import Sphinx

import livebode

NOT_PYTHON = {"cli"}
"""Packages whose reference is another page."""


def packages() -> dict[str, ModuleType]:
    """The packages with public names, by name."""
    names = [f"livebode.{m.name}" for m in pkgutil.iter_modules(livebode.__path__) if m.name not in NOT_PYTHON]
    modules = {name: import_module(name) for name in names}
    return {name: module for name, module in modules.items() if getattr(module, "__all__", None)}


def page(name: str, module: ModuleType) -> str:
    """The page of one package in reStructuredText."""
    homes = {own: _home(own, name, module) for own in sorted(module.__all__, key=str.lower)}
    title = f"``{name}``" if module is livebode else name
    first = (inspect.getdoc(module) or "").split("\n\n")[0]
    parts = [title, "=" * len(title), "", first, ""]
    for home in sorted(set(homes.values()) - {name}):
        there = ", ".join(f":py:obj:`~{home}.{own}`" for own, its in sorted(homes.items()) if its == home)
        parts += [f"In :mod:`{home}`: {there}.", ""]
    parts += [f".. py:module:: {name}", ""]
    for own in (own for own, home in homes.items() if home == name):
        parts += [_entry(name, own, getattr(module, own)), ""]
    return "\n".join(parts)


def _home(own: str, name: str, module: ModuleType) -> str:
    """The package on whose page this name of a package is documented."""
    if own in livebode.__all__:
        return "livebode"
    package = ".".join((getattr(getattr(module, own), "__module__", None) or name).split(".")[:2])
    return package if own in getattr(import_module(package), "__all__", ()) else name


def _entry(package: str, name: str, value: object) -> str:
    """The directive that documents one name."""
    alias = isinstance(value, GenericAlias)  # which Python 3.11 takes for a class
    if inspect.isclass(value) and not alias:
        return f".. autoclass:: {package}.{name}\n   :members:\n"
    if callable(value) and not alias:
        return f".. autofunction:: {package}.{name}\n"
    if alias or type(value).__module__ == "numpy":  # whose documentation is that of the type
        return f".. py:data:: {package}.{name}\n"
    return f".. autodata:: {package}.{name}\n   :no-value:\n"


def write_pages(app: Sphinx) -> None:
    folder = Path(app.confdir) / "reference" / "api"
    folder.mkdir(exist_ok=True)
    wanted = {f"{name}.rst": page(name, module) for name, module in {"livebode": livebode, **packages()}.items()}
    for old in folder.glob("*.rst"):
        if old.name not in wanted:
            old.unlink()
    for file, text in wanted.items():
        path = folder / file
        if not path.exists() or path.read_text("utf-8") != text:
            path.write_text(text, encoding="utf-8")


def keep_bars(_app: Sphinx, _what: str, _name: str, _value: object, _options: object, lines: list[str]) -> None:
    """|G| in a docstring is a magnitude, not a substitution."""
    lines[:] = [re.sub(r"(?<!\\)\|", r"\\|", line) for line in lines]


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("builder-inited", write_pages)
    app.connect("autodoc-process-docstring", keep_bars, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
