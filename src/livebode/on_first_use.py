"""Packages that load a module when one of its names is first used."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from typing import Any


def on_first_use(package: str, names: Mapping[str, Iterable[str]]) -> Callable[[str], Any]:
    """The `__getattr__` of a package whose names are in these modules of it.

    A command that prints its help needs the errors of `core` and not the arrays.
    """
    module = {name: home for home, found in names.items() for name in found}

    def attribute(name: str) -> Any:
        if name not in module:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(f"{package}.{module[name]}"), name)
        setattr(sys.modules[package], name, value)
        return value

    return attribute
