"""Create the source from its settings: its kind is that of the URL."""

from __future__ import annotations

from livebode.core import ConfigError, LocationError
from livebode.locations import Url
from livebode.plugins import loaded, named
from livebode.sources.live.address import Address, checked_address
from livebode.sources.live.follow import FollowSource
from livebode.sources.live.settings import SourceSettings, check_keys
from livebode.sources.live.source import LiveSource


def open_source(settings: SourceSettings) -> LiveSource:
    """The source at `settings.url`, or the `log` that grows; connected, its channels and rate known.

    Raises
    ------
    ConfigError
        If the settings do not fit the kind of source.
    ExtraError
        If the package that it needs is not installed.
    SourceError
        If the peer rejects the connection, or no samples arrive within `timeout_s`.
    """
    return make_source(settings).open()


def make_source(settings: SourceSettings) -> LiveSource:
    """The same, not yet opened; raises the errors of `open_source` for settings and missing packages."""
    if settings.url is None:
        check_keys(settings, "log")
        if len(settings.logs) != 1 or not settings.follow:
            raise ConfigError(
                "key-missing",
                "[source] names no live source",
                "set source.url, such as udp://0.0.0.0:5000, or source.log with source.follow = true",
                key="source",
                keys=["url"],
            )
        if isinstance(settings.logs[0], Url):
            raise LocationError(
                "not-possible",
                f"{settings.logs[0]} cannot be followed: only a file of this computer can grow",
                "remove source.follow, or follow a local file",
                key="source.follow",
                path=str(settings.logs[0]),
            )
        return FollowSource(settings, Address("follow", path=str(settings.logs[0])))
    address = checked_address(settings.url, settings)
    kind: type[LiveSource] = loaded(named("sources")[address.scheme].source)
    return kind(settings, address)
