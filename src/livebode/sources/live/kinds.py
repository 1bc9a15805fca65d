"""Kinds of live sources: each scheme of a URL, its keys in [source], and the class that receives."""

from __future__ import annotations

from collections.abc import Mapping

from livebode.dataclass import dataclass


@dataclass(frozen=True)
class SourceKind:
    """A kind of live source.

    Attributes
    ----------
    source
        "module:name" of the subclass of `LiveSource`; its module imports its library when a source is created.
    keys
        Keys of [source] that it has, in addition to `url` and those of every kind.
    settings
        "module:name" of the subclass of `SourceKeys` that defines those of them that livebode does not; empty: none.
    port
        Usual port of a URL scheme://host:port; None if the URL must have it.
    device
        Example of a URL scheme:path, where that is the form; the class reads the path, with its first slash only if
        the example has one.
    has_path
        Whether scheme://host:port/path is meant.
    survey
        "module:name" of the function that lists what an address offers, as `livebode inspect` shows it; empty: its
        samples, or the fields of messages.
    player
        "module:name" of the `Player` that plays an excitation on its controller; empty if none can.
    """

    source: str
    keys: frozenset[str]
    settings: str = ""
    port: int | None = None
    device: str = ""
    has_path: bool = False
    survey: str = ""
    player: str = ""


MESSAGES = {"rate_hz", "fields", "sample_field"}
"""Keys of a kind whose messages may be those of another program."""
_FRAMES = MESSAGES | {"reorder_batches"}


def _kind(source: str, keys: set[str], port: int | None = None, device: str = "", has_path: bool = False) -> SourceKind:
    return SourceKind(f"livebode.sources.live.{source}", frozenset(keys), port=port, device=device, has_path=has_path)


SOURCES: Mapping[str, SourceKind] = {
    "udp": _kind("udp:UdpSource", _FRAMES | {"sender"}),
    "tcp": _kind("tcp:TcpSource", _FRAMES),
    "stdin": _kind("lines:StdinSource", MESSAGES, device="stdin:"),
}
