"""SinkKind: a kind of receiver of events and results, as a table of plug-ins declares it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Part = Literal["parameters", "responses", "status"]
Events = Literal["all", "alarms", "high", "medium", "low", "info"]


@dataclass(frozen=True)
class SinkKind:
    """A kind of receiver.

    Attributes
    ----------
    sink
        "module:name" of the class, a `SinkConnection`; its module imports its library when a sink is created.
    ports
        The schemes of its URL, each with its usual port; None where the URL must name the port.
    keys
        Keys of [[publish]] that it has, in addition to those of every kind.
    events, values
        What it sends by default.
    serves
        Whether it is a server of livebode at that URL, which others read.
    """

    sink: str
    ports: Mapping[str, int | None]
    keys: frozenset[str]
    events: tuple[Events, ...] = ("all",)
    values: tuple[Part, ...] = ("parameters", "status")
    serves: bool = False
