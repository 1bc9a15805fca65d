"""SettingsFile and SettingsSection: archive.toml and fleet.toml, and their tables, read in one way."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Self, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from livebode.configuration import one_line, read_table, shortened
from livebode.core import ConfigError, nearest_name


class SettingsSection(BaseModel):
    """A table of a TOML file."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    def beside(self, folder: Path) -> Self:
        """The section with its paths, and those of its sections, relative to a folder."""
        return self.model_copy(update={name: _beside(folder, value) for name, value in self})


class SettingsFile(SettingsSection):
    """The whole of a TOML file."""

    @classmethod
    def read(cls, path: Path) -> Self:
        """The settings of a file, with paths from its folder.

        Raises
        ------
        ConfigError
            If it cannot be read, or a key or value is invalid; the message gives both.
        """
        return cls.of(read_table(path), str(path)).beside(path.parent)

    @classmethod
    def of(cls, data: dict[str, Any], origin: str) -> Self:
        """The settings in plain data; `origin` names it in messages."""
        try:
            settings = cls.model_validate(data)
            settings.check_values()
        except ValidationError as error:
            raise _first_error(error, cls).at(origin) from None
        except ConfigError as error:
            raise error.at(origin) from None
        return settings

    def check_values(self) -> None:
        """ConfigError if values are valid each by itself, and not together."""


def place_beside(folder: Path, place: str) -> str:
    """A path relative to a folder; a URL as it is."""
    return place if "://" in place else str(folder / place)


def _beside(folder: Path, value: Any) -> Any:
    if isinstance(value, SettingsSection):
        return value.beside(folder)
    return folder / value if isinstance(value, Path) else value


def _first_error(error: ValidationError, settings: type[SettingsSection]) -> ConfigError:
    """The first error, with its key and value; missing keys last, because a misspelt key also causes a missing one."""
    first = min(error.errors(include_url=False), key=lambda one: one["type"] == "missing")
    place = one_line(".".join(str(part) for part in first["loc"]))
    if first["type"] == "missing":
        return ConfigError("key-missing", f"{place!r} is missing", "add it", key=place)
    if first["type"] == "extra_forbidden":
        *sections, name = map(str, first["loc"])
        near = nearest_name(name, list(_section(settings, sections).model_fields), "Settings")
        return ConfigError("key-unknown", f"there is no setting {place!r}", near, key=place)
    value = shortened(first["input"])
    return ConfigError(
        "value-invalid",
        f"{place} = {value} is not usable: {first['msg'].lower()}",
        "correct it",
        key=place,
        value=value,
    )


def _section(settings: type[SettingsSection], names: list[str]) -> type[SettingsSection]:
    """The section of this name in the settings, also an optional one."""
    for name in names:
        kind = settings.model_fields[name].annotation
        settings = next(
            part for part in (kind, *get_args(kind)) if isinstance(part, type) and issubclass(part, SettingsSection)
        )
    return settings
