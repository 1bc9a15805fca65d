"""The description of a gantry in a TOML file."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

from livebode.configuration import read_table, shortened
from livebode.core import UsageError, counted, nearest_name
from livebode.simulation import Gantry


def read_gantry(path: Path) -> Gantry:
    """The gantry that a TOML file describes: numbers with the names of `Gantry`.

    Raises
    ------
    ConfigError
        If the file cannot be read or is not TOML.
    UsageError
        If a name is not one of a gantry's, a value is not a number, or is out of range.
    """
    table = read_table(path)
    names = [field.name for field in fields(Gantry)]
    values: dict[str, Any] = {}
    for name, value in table.items():
        if name not in names:
            raise UsageError(
                "unknown-name",
                f"{str(path)!r}: a gantry has no parameter {name!r}",
                nearest_name(name, names, "Parameters of a gantry"),
                argument="gantry",
                value=name,
                allowed=names,
            )
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise UsageError(
                "not-finite",
                f"{str(path)!r}: {name} = {shortened(value)} is not a number",
                "write one in the unit of the name",
                argument="gantry",
                value=shortened(value),
            )
        values[name] = float(value)
    missing = [name for name in names if name not in values and not name.startswith("right_")]
    if missing:
        raise UsageError(
            "missing",
            f"{str(path)!r} lacks {counted(len(missing), 'parameter')} of the gantry: {', '.join(missing)}",
            "specify them, as far as they are known; belts, masses and damping are fitted",
            argument="gantry",
            missing=missing,
        )
    return Gantry(**values)
