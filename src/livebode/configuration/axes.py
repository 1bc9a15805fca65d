"""The axes of a file: one, or several under [axes], each with the common sections of the file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from livebode.configuration.axis import Axis
from livebode.configuration.fit_section import check_fit
from livebode.configuration.toml_file import parse_table, read_bytes, shortened
from livebode.core import ConfigError, LivebodeError

AXES_MAX = 256
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
SUCCESSOR = re.compile(r".*-[0-9]+")
Axes = Mapping[str, Axis]
"""Axes by name; the only axis of a file without [axes] has the empty name."""


class ConfigurationFile:
    """A TOML file of axes that may be edited while they run.

    Parameters
    ----------
    path
        The file; relative paths in it are from its folder.
    over
        Sections whose keys replace those of every axis: options of the command line.
    """

    def __init__(self, path: Path, over: Mapping[str, Mapping[str, Any]]) -> None:
        self.path, self._over = path, over
        self._used = self._seen = b""

    def read(self) -> dict[str, Axis]:
        """The axes in it.

        Raises
        ------
        ConfigError
            If it cannot be read, is not TOML, or an axis is invalid; the message gives axis, key and value.
        LivebodeError
            If a value is invalid for another reason, such as the address of a source.
        """
        self._used = self._seen = read_bytes(self.path)
        return axes_of(self._used, self.path, self._over)

    def changed(self) -> bool:
        """Whether it differs from what was read last, and was not written since the last check."""
        try:
            data = read_bytes(self.path)
        except ConfigError:
            return False  # an editor may be replacing it
        steady, self._seen = data == self._seen, data
        return steady and data != self._used


def axes_of(data: bytes, path: Path, over: Mapping[str, Mapping[str, Any]]) -> dict[str, Axis]:
    """The axes in the bytes of a file; see `ConfigurationFile`."""
    found = {}
    for name, table in tables_of(parse_table(data, str(path)), str(path)).items():
        origin = f"{path}, axis {name}" if name else str(path)
        axis = Axis.of(table, origin).beside(path.parent)
        if over:
            axis = Axis.of(merged(axis.model_dump(exclude_unset=True, by_alias=True), over), origin)
        if axis.fit is not None:
            try:
                check_fit(axis.fit)
            except LivebodeError as error:
                raise error.at(f"{origin}: [fit]") from None
        found[name] = axis
    return found


def tables_of(data: Mapping[str, Any], origin: str) -> dict[str, dict[str, Any]]:
    """Sections of each axis: those outside [axes] apply to all, and its own replace them key by key."""
    if "axes" not in data:
        return {"": dict(data)}
    axes = data["axes"]
    if not isinstance(axes, dict) or not axes or not all(isinstance(axis, dict) for axis in axes.values()):
        raise ConfigError(
            "axes-invalid", "'axes' is not a table of axes", "write [axes.NAME.source] and so on", key="axes"
        ).at(origin)
    if len(axes) > AXES_MAX:
        raise ConfigError(
            "axes-invalid",
            f"there are {len(axes)} axes, more than {AXES_MAX}",
            "use several files",
            key="axes",
            count=len(axes),
            limit=AXES_MAX,
        ).at(origin)
    shared = {key: value for key, value in data.items() if key != "axes"}
    for name in axes:
        _check_name(name, origin)
    folded = [name.casefold() for name in axes]
    if twice := [name for name in axes if folded.count(name.casefold()) > 1]:
        raise ConfigError(
            "axis-name-invalid",
            f"the axes {' and '.join(map(repr, twice[:2]))} differ only in upper and lower case",
            "rename one of them",
            key="axes",
            names=twice[:2],
        ).at(origin)
    return {name: _named(merged(shared, axis), name) for name, axis in axes.items()}


def _named(axis: dict[str, Any], name: str) -> dict[str, Any]:
    """With its name in [machine], if there is that section without one."""
    machine = axis.get("machine")
    return axis | {"machine": {"axis": name} | machine} if isinstance(machine, dict) else axis


def merged(below: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Both merged key by key, down to single values; `over` has priority.

    >>> merged({"lines": {"window": 400}, "fit": {}}, {"lines": {"window": 800, "frequencies": "20"}})
    {'lines': {'window': 800, 'frequencies': '20'}, 'fit': {}}
    """
    result = dict(below)
    for key, value in over.items():
        before = result.get(key)
        both = isinstance(before, Mapping) and isinstance(value, Mapping)
        result[key] = merged(before, value) if both else value  # type: ignore[arg-type]
    return result


def _check_name(name: str, origin: str) -> None:
    if not NAME.fullmatch(name):
        raise ConfigError(
            "axis-name-invalid",
            f"the axis {shortened(name)} cannot be the name of a directory",
            "choose up to 64 letters, digits, _ and -, with a letter or digit first",
            key="axes",
            value=shortened(name),
        ).at(origin)
    if SUCCESSOR.fullmatch(name):
        raise ConfigError(
            "axis-name-invalid",
            f"the axis {name!r} has a name that is reserved for a run that continues another",
            f"rename it {name.replace('-', '_')!r}",
            key="axes",
            value=name,
        ).at(origin)
