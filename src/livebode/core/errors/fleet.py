"""A fleet that cannot be run or checked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class FleetError(LivebodeError):
    """A fleet, its log or one of its axes cannot be used.

    Examples
    --------
    >>> import livebode
    >>> livebode.FleetError.codes["log-unreachable"]
    'The server of the log cannot be reached, or rejects the connection.'
    """

    area: ClassVar[str] = "fleet"
    codes: ClassVar[Mapping[str, str]] = {
        "authority-unusable": "The certificate of the authority of the log cannot be used.",
        "axis-duplicated": "Two axes of the fleet have the same site, line, machine and axis.",
        "axis-failed": "The messages of an axis cannot be tracked with its configuration.",
        "axis-unknown": "The fleet has no axis of this path.",
        "axis-unnamed": "An axis of the fleet has no [machine] section, so its place in the log is not defined.",
        "buffer-locked": "Another process uses the disk buffer of an edge.",
        "buffer-unusable": "The disk buffer of an edge cannot be read or written.",
        "cluster-open": "Others could join the servers of the log, because they have no TLS or no authority.",
        "credentials-unusable": "A file with the key of a user of the log cannot be used, or can be by others.",
        "leaf-missing": "The configuration of the fleet has no section [leaf].",
        "leaf-open": "The way of a leaf node to the log has no mutual TLS.",
        "leaves-unknown": "The server of the log could not check the certificates of leaf nodes.",
        "log-incomplete": "The log no longer has its beginning, so the results cannot be computed again.",
        "log-refused": "The server of the log does not accept the key of the user.",
        "log-unreachable": "The server of the log cannot be reached, or rejects the connection.",
        "log-untrusted": "The server of the log has no TLS, or a certificate that is not trusted.",
        "member-unknown": "It is not known which server of the cluster is meant.",
        "no-data": "The log has no data of this axis in the time that was asked for.",
        "not-exactly-once": "Stored responses are missing, doubled or different from one uninterrupted computation.",
        "partitions-changed": "The number of partitions differs from that of the data in the log.",
        "results-of-other-version": "The results in the log were written by another version of livebode.",
        "server-ended": "The server of the log ended at its start.",
        "server-missing": "The program nats-server is not installed.",
        "server-open": "The server of the log would be open to a network without TLS or keys.",
        "servers-missing": "The log is to have more copies than there are servers.",
        "view-only": "The key of this user may read the log, and store nothing there.",
        "worker-not-started": "The system starts no process for a worker of a fleet.",
    }
    temporary_codes: ClassVar[frozenset[str]] = frozenset(
        {"buffer-locked", "buffer-unusable", "log-unreachable", "worker-not-started"}
    )
