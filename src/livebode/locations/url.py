"""Where a file is: a path of this computer, or a URL of a storage."""

from __future__ import annotations

import os
import re
from functools import cached_property
from pathlib import Path, PurePosixPath

_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]+)://")  # two letters or more: C:// is a drive
_USER = re.compile(r"(?<=://)[^/]*@")
_PASSWORD = re.compile(r"(?<=://)([^/@:]*):[^/]*(?=@)")
_QUERY = re.compile(r"\?.*", re.DOTALL)
_WEB = ("http", "https")


class Url:
    """A URL of a file or directory; as a text it is without what may be secret: password, and user and query of http.

    Parameters
    ----------
    address
        The whole URL.

    Examples
    --------
    >>> url = Url("ftp://user:secret@host/site/a.csv")
    >>> print(url, url.name, url.suffix)
    ftp://user@host/site/a.csv a.csv .csv
    >>> url
    Url('ftp://user@host/site/a.csv')
    """

    def __init__(self, address: str) -> None:
        self.address = address

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Url) and self.address == other.address

    def __hash__(self) -> int:
        return hash(self.address)

    def __str__(self) -> str:
        if self.scheme in _WEB:  # a token may be the user; elsewhere "?" is part of a name or a pattern
            return _QUERY.sub("", _USER.sub("", self.address))
        return _PASSWORD.sub(r"\1", self.address)

    def __repr__(self) -> str:
        return f"Url({str(self)!r})"

    def __truediv__(self, name: str) -> Url:
        return Url(f"{self.address.rstrip('/')}/{name}")

    @property
    def scheme(self) -> str:
        """What is before "://", in lower case."""
        return self.address.partition("://")[0].lower()

    @property
    def name(self) -> str:
        """The last part."""
        return self._path.name

    @property
    def stem(self) -> str:
        """The last part without its ending."""
        return self._path.stem

    @property
    def suffix(self) -> str:
        """The ending, with its dot."""
        return self._path.suffix

    @cached_property
    def _path(self) -> PurePosixPath:
        return PurePosixPath(str(self).partition("://")[2])


Location = Path | Url


def resolved(place: Location) -> Location:
    """The place by its only name: a path is absolute and without links."""
    return place.resolve() if isinstance(place, Path) else place


def location(place: str | os.PathLike[str] | Url) -> Location:
    """The place of a file; a file:// URL is a path.

    >>> location("s3://bucket/site/a.csv"), location("logs/a.csv").parts
    (Url('s3://bucket/site/a.csv'), ('logs', 'a.csv'))
    """
    if isinstance(place, Url):
        return place
    text = os.fspath(place)
    scheme = _SCHEME.match(text)
    if scheme is None:
        return Path(place)
    return _path_of(text) if scheme[1].lower() == "file" else Url(text)


def _path_of(url: str) -> Path:
    from urllib.parse import urlsplit
    from urllib.request import url2pathname  # with an HTTP client

    return Path(url2pathname(urlsplit(url).path))
