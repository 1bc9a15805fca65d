"""SettingsSection: what the tables of archive.toml and of fleet.toml have in common."""

from __future__ import annotations

from pathlib import Path
from typing import Self, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from livebode.configuration import one_line, shortened
from livebode.core import ConfigError, nearest_name


class SettingsSection(BaseModel):
    """A table of a TOML file, or the whole of it."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    def with_files(self, folder: Path, *names: str) -> Self:
        """The section with the files of these keys relative to a folder."""
        files = {name: getattr(self, name) for name in names}
        return self.model_copy(update={name: folder / path for name, path in files.items() if path is not None})


def first_error(error: ValidationError, settings: type[SettingsSection]) -> ConfigError:
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
            one for one in (kind, *get_args(kind)) if isinstance(one, type) and issubclass(one, SettingsSection)
        )
    return settings
