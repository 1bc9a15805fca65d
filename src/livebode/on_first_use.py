"""Packages whose names load their module when they are first used."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module


def on_first_use(package: str, file: str) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    """The `__getattr__`, `__dir__` and `__all__` of a package whose names its `__init__.pyi` imports.

    The stub is the only list of the names: a type checker reads it too. Each is there as `name as name`, which is how a
    stub exports it. A command that prints its help needs the errors of `core` and not the arrays.
    """
    homes: dict[str, tuple[str, str]] = {}
    home = ""
    with open(f"{file}i", encoding="utf-8") as stub:
        for line in stub:
            words = line.replace("(", " ").replace(",", " ").split()
            if words and words[0] == "from":
                home, words = words[1], words[3:]
            homes |= {shown: (home, name) for name, shown in zip(words[::3], words[2::3], strict=False)}

    def attribute(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        home, own = homes[name]
        value: object = getattr(import_module(home), own)
        setattr(sys.modules[package], name, value)
        return value

    return attribute, lambda: sorted({*vars(sys.modules[package]), *homes}), sorted(homes)
