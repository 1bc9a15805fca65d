"""Names in the log: subjects and streams. A subject names the machine; the server adds the partition."""

from __future__ import annotations

from typing import Final
from urllib.parse import quote, unquote

from livebode.configuration import MachineSection

LEVELS: Final = 4
"""Site, line, machine, axis."""
EDGE, LOG, RESULTS, STATES, STATUS, ACTS = "edge", "in", "res", "state", "status", "act"
"""First tokens: what an edge publishes, the same after the server's mapping, results, states, the status, and what
persons do with alarms: act.KIND.AXIS."""
LOG_STREAM, RESULT_STREAM, STATE_STREAM, STATUS_STREAM, ACTS_STREAM = "LOG", "RESULTS", "STATES", "STATUS", "ACTS"
API: Final = "$JS.API"
VIEW_API: Final = "viewer"
"""First tokens of requests to JetStream: its own, and those of a viewer."""
SINK: Final = "sink-"
"""Beginning of the second token of the status of a sink; that of a partition is its number."""
_EMPTY = "_"


def axis_key(machine: MachineSection) -> str:
    """Four tokens of a subject, from the levels of a machine; a level without a name is an underscore.

    >>> axis_key(MachineSection(site="Ulm 2", machine="press.4", axis="x"))
    'Ulm%202._.press%2E4.x'
    """
    return ".".join(axis_token(name) for name in (machine.site, machine.line, machine.machine, machine.axis))


def axis_names(key: str) -> list[str | None]:
    """The names of the levels, from the four tokens.

    >>> axis_names("Ulm%202._.press%2E4.x")
    ['Ulm 2', None, 'press.4', 'x']
    """
    return [None if token == _EMPTY else unquote(token) for token in key.split(".")]


def axis_path(key: str) -> str:
    """The path of a machine as a person reads it, from its four tokens.

    >>> axis_path("Ulm%202._.press%2E4.x")
    'Ulm 2/press.4/x'
    """
    return "/".join(name for name in axis_names(key) if name)


def key_of(subject: str) -> str:
    """The four tokens of the axis in a subject of the log or of a state.

    >>> key_of("in.7.ulm._.press.x")
    'ulm._.press.x'
    """
    return subject.split(".", 2)[2]


def axis_token(name: str | None) -> str:
    """The token of a subject for the name of one level."""
    if not name:
        return _EMPTY
    escaped = quote(name, safe="").replace(".", "%2E")
    return "%5F" if escaped == _EMPTY else escaped
