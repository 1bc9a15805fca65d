"""ServerAccess: who may do what in the log, as accounts of nats-server."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from urllib.parse import quote

from livebode.core import FleetError, on_loopback
from livebode.sources.live import FRAME_BYTES_MAX
from livebode_plant.fleet.fleet_settings import FleetSettings, ServerSection, UsersSection
from livebode_plant.fleet.page_status import NAMES, VIEW
from livebode_plant.fleet.subjects import ACTS_STREAM, API, EDGE, STATUS_STREAM, VIEW_API, axis_path

_FLEET, _VIEW = "FLEET", "VIEW"
_CONNECTIONS_MORE, _SUBSCRIPTIONS = 4, 4
_MESSAGE_BYTES_MAX = 2 * FRAME_BYTES_MAX
"""Largest message of an edge: a frame with the names of the channels, and one of samples."""
_VIEWED = ("STREAM.INFO.*", f"STREAM.MSG.GET.{STATUS_STREAM}", f"STREAM.MSG.GET.{ACTS_STREAM}")
"""Requests of a viewer. A consumer is not one of them: it could deliver to any subject of the log's account."""
_ONLY_ASKS = json.dumps([f"{VIEW_API}.{request}" for request in _VIEWED])


@dataclass(frozen=True)
class ServerAccess:
    """The certificate of a server, its users, and the axes that each edge may send.

    Every path of edges and the viewers have an account of their own. Permissions in one common account would not
    suffice: the server sends its acknowledgement to the subject that the sender names for it, with the rights of the
    account, and so an edge that names a request of JetStream there could have the log deleted.

    Attributes
    ----------
    axes
        Keys of the axes of the fleet.
    """

    server: ServerSection
    users: UsersSection
    axes: Sequence[str]

    def lines(self, mappings: str) -> list[str]:
        """Lines of the configuration of nats-server; `mappings` belong to the account of the log."""
        tls = []
        if self.server.certificate is not None and self.server.key is not None:
            files = (("cert_file", self.server.certificate), ("key_file", self.server.key))
            tls = ["tls {", *(f"  {name}: {json.dumps(str(path.absolute()))}" for name, path in files), "}"]
        return [*tls, *(self._accounts(mappings) if self.users.fleet else [mappings])]

    def leaf_lines(self, host: str) -> list[str]:
        """Lines for leaf nodes, which prove by a certificate whose axes they may send."""
        if self.server.leaf_port is None:
            return []
        files = {"cert_file": self.server.certificate, "key_file": self.server.key, "ca_file": self.server.authority}
        return [
            "leafnodes {",
            f"  listen: {json.dumps(f'{host}:{self.server.leaf_port}')}",
            "  no_advertise: true",
            "  tls {",
            *(f"    {name}: {json.dumps(str(path.absolute()))}" for name, path in files.items() if path is not None),
            "    verify_and_map: true",
            "  }",
            "}",
        ]

    def _accounts(self, mappings: str) -> list[str]:
        edges = {path: self._allowed(path) for path in {**self.users.edges, **self.users.leaves}}
        senders: dict[str, list[str]] = {}
        for path, subjects in edges.items():
            for subject in subjects:
                senders.setdefault(subject, []).append(_account(path))
        exports = [_service(subject, accounts) for subject, accounts in sorted(senders.items())]
        exports += [_service(f"{API}.{request}", [_VIEW]) for request in _VIEWED]
        viewed = [_import(f"{API}.{request}", f', to: "{VIEW_API}.{request}"') for request in _VIEWED]
        for subject in (f"{VIEW}.*", f"{NAMES}.*"):  # what workers publish for the page of the fleet
            exports.append(f"{{stream: {json.dumps(subject)}, accounts: {json.dumps([_VIEW])}}}")
            viewed.append(f"{{stream: {{account: {_FLEET}, subject: {json.dumps(subject)}}}}}")
        text = ["accounts {", f"  {_FLEET} {{", "    jetstream: enabled", f"    {mappings}", _users(self.users.fleet)]
        text += [_list("exports", exports), "  }", f"  {_VIEW} {{", _users(self.users.view), _list("imports", viewed)]
        # Else a viewer could publish a status of its own to the pages of other viewers.
        text += [f"    default_permissions: {{ publish: {_ONLY_ASKS} }}"]
        for path, subjects in edges.items():
            keys, leaves = self.users.edges.get(path, ()), self.users.leaves.get(path, ())
            text += ["  }", f"  {json.dumps(_account(path))} {{", _users(keys, leaves)]
            text += [self._limits(len(subjects))]
            text += [_list("imports", map(_import, subjects))]
        return [*text, "  }", "}"]

    def _limits(self, axes: int) -> str:
        """What the account of an edge may use: a connection for each axis, twice because old ones may linger."""
        connections = 2 * axes + _CONNECTIONS_MORE
        limits = {
            "max_connections": connections,
            "max_subscriptions": connections * _SUBSCRIPTIONS,
            "max_payload": _MESSAGE_BYTES_MAX,
        }
        return "    limits { " + ", ".join(f"{name}: {value}" for name, value in limits.items()) + " }"

    def _allowed(self, path: str) -> list[str]:
        """Subjects of the axes at or below a path; FleetError if there are none."""
        found = [f"{EDGE}.{key}" for key in self.axes if f"{axis_path(key)}/".startswith(f"{path}/")]
        if not found:
            raise FleetError(
                "axis-unknown",
                f"the fleet has no axis {path!r} and none below it",
                "correct the path in [users.edges], or add the axis to axes",
                axis=path,
            )
        return found


OPEN = ServerAccess(ServerSection(), UsersSection(), ())
"""Everyone may do everything: for a server on the loopback."""


def server_access(settings: FleetSettings, host: str) -> ServerAccess:
    """The access of a fleet's server that listens at `host`.

    Raises
    ------
    FleetError
        If it would be open to the network: off the loopback it needs TLS and keys of users.
    """
    complete = settings.server.certificate and settings.server.key and settings.users.fleet
    if settings.server.leaf_port is not None and not (complete and settings.server.authority):
        raise FleetError(
            "leaves-unknown",
            "a leaf node proves by its certificate which axes it may send, and the server could not check it",
            "set server.certificate, server.key, server.authority and users.fleet",
        )
    if not on_loopback(host) and not complete:
        raise FleetError(
            "server-open",
            f"a server at {host} would be open to everyone who reaches it",
            "set server.certificate, server.key and users.fleet; `livebode fleet setup` makes keys",
            host=host,
        )
    limited = settings.users.edges or settings.users.leaves
    return ServerAccess(settings.server, settings.users, list(settings.read_axes()) if limited else [])


def _account(path: str) -> str:
    return f"EDGE {quote(path, safe='')}"


def _users(keys: Iterable[str], leaves: Iterable[str] = ()) -> str:
    found = [f"{{nkey: {key}}}" for key in keys]
    # A name without a password is enough only where a certificate proves it.
    found += [f'{{user: {json.dumps(name)}, allowed_connection_types: ["LEAFNODE"]}}' for name in leaves]
    return "    users: [ " + ", ".join(found) + " ]"


def _service(subject: str, accounts: Sequence[str]) -> str:
    return f"{{service: {json.dumps(subject)}, accounts: {json.dumps(accounts)}}}"


def _import(subject: str, to: str = "") -> str:
    return f"{{service: {{account: {_FLEET}, subject: {json.dumps(subject)}}}{to}}}"


def _list(name: str, entries: Iterable[str]) -> str:
    return "\n".join([f"    {name}: [", *(f"      {entry}" for entry in entries), "    ]"])
