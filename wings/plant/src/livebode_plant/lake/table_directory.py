"""The directory of a table: options of its storage, what may be in it, and the removal of files it does not need."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO

import pyarrow as pa
import pyarrow.parquet as pq

from livebode.core import ArchiveError, remove_files
from livebode.locations import Location, Url, opened, reporting
from livebode.records import is_folder, open_read
from livebode_plant.lake.data_file import JOINED

_KEYS = {
    "key": "aws_access_key_id",
    "secret": "aws_secret_access_key",
    "token": "aws_session_token",
    "endpoint_url": "aws_endpoint_url",
    "anon": "aws_skip_signature",
}
_ENDPOINTS = ("AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL")


def delta_options(place: Location) -> dict[str, str]:
    """What deltalake needs as ``storage_options`` besides the variables ``AWS_…``, which it reads itself.

    They are from the configuration of fsspec, so that one place describes a storage; none for a path. Plain http is
    allowed where the configured endpoint has it.
    """
    if isinstance(place, Path) or place.scheme not in ("s3", "s3a"):
        return {}
    from fsspec.config import conf

    own: dict[str, Any] = {**conf.get("s3", {})}
    client = own.get("client_kwargs") or {}
    options = {_KEYS[name]: str(value) for name, value in {**client, **own}.items() if name in _KEYS and value}
    if region := client.get("region_name"):
        options["aws_region"] = str(region)
    endpoint = options.get("aws_endpoint_url") or next(
        (os.environ[name] for name in _ENDPOINTS if name in os.environ), ""
    )
    if endpoint.startswith("http://"):
        options |= {"aws_endpoint_url": endpoint, "aws_allow_http": "true"}
    return options


LOG = "_delta_log"
_SHOWN = 5
_DATA = re.compile(
    rf"([0-9a-f]{{64}}-[0-9a-f]{{16}}|rows|{JOINED}|[0-9]{{4}}-[0-9]{{2}}-[0-9]{{2}})-[0-9a-f]{{64}}\.parquet"
)
"""Names of the files of a table."""
_UNFINISHED = re.compile(rf"\.[0-9a-z.-]{{1,50}}\.partial-[0-9a-f]{{8}}|{_DATA.pattern}#[0-9]+")
"""Names of what a kill may leave."""


def check_directory(lake: Path, table: str) -> None:
    """Check the directory of a table on this computer, if it exists.

    Raises
    ------
    ArchiveError
        If it is a link, or contains anything that livebode did not write.
    """
    place = lake / table
    for folder in (lake, place, place / LOG):
        if (folder.exists() or folder.is_symlink()) and not is_folder(folder):
            raise foreign(table, str(folder.parent), [folder.name])
    if place.exists():
        others = [path.name for path in place.iterdir() if not (_is_own(path.name) and _is_regular(path))]
        if set(others) - {LOG}:
            raise foreign(table, str(place), sorted(set(others) - {LOG}))


def check_names(table: str, place: str, names: Sequence[str]) -> None:
    """ArchiveError if the log of a table, or a listing of its directory, has a name that is not of a data file."""
    if others := [name for name in names if not _DATA.fullmatch(name)]:
        raise foreign(table, place, others)


def foreign(table: str, place: str, names: Sequence[str]) -> ArchiveError:
    """The error for something that livebode did not write."""
    more = f" and {len(names) - _SHOWN} more" * (len(names) > _SHOWN)
    return ArchiveError(
        "foreign-files",
        f"the table {table} of the lake is not changed, because {place!r} has files that livebode did not write: "
        f"{', '.join(map(repr, sorted(names)[:_SHOWN]))}{more}",
        "move them away, or choose another lake",
        path=place,
        table=table,
        files=sorted(names),
    )


def remove_data(place: Location, table: str, names: Sequence[str], schema: pa.Schema) -> None:
    """Remove data files from the directory of a table.

    Raises
    ------
    ArchiveError
        If a file has other columns than the table, so that livebode did not write it. Nothing is removed then.
    OSError, LocationError
        If a file cannot be read or removed.
    """
    if isinstance(place, Url):
        system, inside = opened(place)
        with reporting(place):
            others = [name for name in names if not _is_of_table(system.open(f"{inside}/{name}"), schema)]
            if not others:
                for name in names:
                    system.rm_file(f"{inside}/{name}")
    else:
        others = [name for name in names if not _is_of_table(open_read(place, name), schema)]
        if not others:
            remove_files(place, names)
    if others:
        raise foreign(table, str(place), others)


def _is_of_table(file: BinaryIO, schema: pa.Schema) -> bool:
    """Whether it is a Parquet file with columns of the table."""
    with file:
        try:
            names = pq.read_schema(file).names
        except pa.ArrowInvalid:
            return False
    return bool(names) and set(names) <= set(schema.names)


def _is_own(name: str) -> bool:
    return bool(_DATA.fullmatch(name) or _UNFINISHED.fullmatch(name))


def _is_regular(path: Path) -> bool:
    return stat.S_ISREG(path.lstat().st_mode)
