"""Storages behind URLs, by fsspec; their errors as sentences that name the URL and what to do."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from livebode.core import LivebodeError, LocationError, not_installed
from livebode.locations.url import Url
from livebode.plugins import named

_logger = logging.getLogger(__name__)
_CREDENTIALS = "give credentials as the storage expects them (docs/how-to/remote.md)"
_NO_CREDENTIALS = ("NoCredentialsError", "PartialCredentialsError", "ProfileNotFound", "TokenRetrievalError")
_NETWORK = ("EndpointConnectionError", "ClientError", "HTTPClientError", "ConnectTimeoutError", "ServerTimeoutError")
_WITHIN = (
    "ClientPayloadError",
    "IncompleteReadError",
    "ResponseStreamingError",
    "ServerDisconnectedError",
    "ReadTimeoutError",
)
_REASON_LETTERS = 200
_S3 = ("s3", "s3a")
_PIECE_BYTES = 8 << 20
_WITHOUT_DIRECTORIES = (*_S3, "gs", "gcs", "az", "abfs", "abfss", "memory")


def opened(url: Url) -> tuple[Any, str]:
    """The fsspec file system of a URL, and the path there.

    Raises
    ------
    ExtraError
        If fsspec, or what it needs for this scheme, is not installed.
    LocationError
        If the scheme is unknown, or an option of the storage is invalid.
    """
    try:
        from fsspec.core import url_to_fs
    except ImportError:
        raise not_installed(
            f"{url} needs the package fsspec, which is not installed", package="fsspec", extra="remote", path=str(url)
        ) from None
    try:
        # A listing of before would hide what another process wrote since.
        system, path = url_to_fs(url.address, use_listings_cache=False)
    except ImportError as error:
        if url.scheme in _S3:
            raise not_installed(
                f"{url} needs the package s3fs, which is not installed", package="s3fs", extra="remote", path=str(url)
            ) from None
        raise _unusable(url, error, "install that package") from None
    except ValueError as error:
        remedy = "check the part before ://"
        if url.scheme in named("sources"):
            remedy = f"it is a live source: write its configuration by livebode inspect {url} --out axis.toml"
        raise _unusable(url, error, remedy) from None
    return system, path


def make_parent(url: Url, system: Any, path: str) -> None:
    """Create the directory of a path, where the storage has directories; a missing bucket is not created."""
    if url.scheme not in _WITHOUT_DIRECTORIES:
        system.makedirs(system._parent(path), exist_ok=True)


def in_pieces(url: Url) -> dict[str, int]:
    """Options of get_file and put_file that bound the memory for a large file; s3fs takes 500 MB otherwise.

    One piece after the other: a download is then one answer of the server, of one version of the file.
    """
    return {"chunksize": _PIECE_BYTES, "max_concurrency": 1} if url.scheme in _S3 else {}


def check_bucket(url: Url, system: Any, path: str) -> None:
    """FileNotFoundError if the bucket of a path is missing, where the storage has buckets."""
    if url.scheme in _WITHOUT_DIRECTORIES and (bucket := path.partition("/")[0]):
        system.info(bucket)


@contextmanager
def reporting(url: Url) -> Iterator[None]:
    """Within, an error of the storage is raised as a `LocationError`; others, such as of a full disk, remain."""
    try:
        yield
    except (LivebodeError, KeyboardInterrupt):
        raise
    except Exception as error:
        raise _sentence(url, error) from error


def _sentence(url: Url, error: Exception) -> LocationError:
    facts = {"path": str(url), "reason": _first_line(error)}
    _logger.debug("%s: %s", url, type(error).__name__)
    kinds = {kind.__name__ for cause in _chain(error) for kind in type(cause).__mro__}
    if isinstance(error, FileExistsError):
        return LocationError("exists", f"{url} exists already", "choose another URL", **facts)
    if isinstance(error, FileNotFoundError):
        return LocationError("not-found", f"there is nothing at {url}", "check bucket and name", **facts)
    if kinds & set(_NO_CREDENTIALS):
        return LocationError("no-credentials", f"{url} needs credentials, and none were found", _CREDENTIALS, **facts)
    if isinstance(error, PermissionError):
        return LocationError("denied", f"access to {url} was denied", f"ask for access, or {_CREDENTIALS}", **facts)
    if kinds & set(_WITHIN):
        return LocationError("interrupted", f"the connection ended while {url} was in use", "try again", **facts)
    if isinstance(error, ConnectionError | TimeoutError) or kinds & set(_NETWORK):
        return LocationError(
            "not-reachable",
            f"the storage of {url} does not answer",
            "check the network and the address of the storage (docs/how-to/remote.md)",
            **facts,
        )
    return LocationError("failed", f"{url} cannot be used: {facts['reason']}", "check the URL and the storage", **facts)


def _unusable(url: Url, error: Exception, remedy: str) -> LocationError:
    message = f"{url} cannot be opened: {_first_line(error)}"
    return LocationError("scheme-unknown", message, remedy, path=str(url))


def _chain(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__


def _first_line(error: Exception) -> str:
    """The beginning of a library's message, without what may be a secret in a URL."""
    lines = str(error).strip().splitlines()
    words = (lines[0] if lines else type(error).__name__)[:_REASON_LETTERS].rstrip(" .").split(" ")
    return " ".join(str(Url(word)) if "://" in word else word for word in words)
