"""The kinds of TOML files that the commands of this wing read."""

from __future__ import annotations

from collections.abc import Mapping

from livebode.configuration import FileKind

FILES: Mapping[str, FileKind] = {
    "archive": FileKind(
        "livebode_plant.archive.archive_settings:archive_schema",
        "an archive",
        frozenset({"inputs", "recipe", "lake", "cluster"}),
        "livebode_plant.archive.archive_settings:ArchiveSettings",
    )
}
