"""Where a file is: a path of this computer, or a URL of a storage."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath
from urllib.parse import urlsplit
from urllib.request import url2pathname

_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]+)://")  # two letters or more: C:// is a drive
_USER = re.compile(r"(?<=://)[^/]*@")
_QUERY = re.compile(r"\?.*", re.DOTALL)
_WEB = ("http", "https")


@dataclass(frozen=True)
class Url:
    """A URL of a file or directory; as a text it is without user, password and query, which may be a secret.

    Parameters
    ----------
    address
        The whole URL.

    Examples
    --------
    >>> url = Url("ftp://user:secret@host/site/a.csv")
    >>> print(url, url.name, url.suffix)
    ftp://host/site/a.csv a.csv .csv
    >>> url
    Url('ftp://host/site/a.csv')
    """

    address: str

    def __str__(self) -> str:
        shown = _USER.sub("", self.address)
        return _QUERY.sub("", shown) if self.scheme in _WEB else shown  # elsewhere "?" is part of a name or a pattern

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


def location(place: str | os.PathLike[str] | Url) -> Location:
    """The place of a file; a file:// URL is a path.

    >>> location("s3://bucket/site/a.csv"), location("logs/a.csv")
    (Url('s3://bucket/site/a.csv'), PosixPath('logs/a.csv'))
    """
    if isinstance(place, Url):
        return place
    text = os.fspath(place)
    found = _SCHEME.match(text)
    if found is None:
        return Path(place)
    return Path(url2pathname(urlsplit(text).path)) if found[1].lower() == "file" else Url(text)
