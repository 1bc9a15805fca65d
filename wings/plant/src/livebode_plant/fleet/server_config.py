"""Configuration of nats-server: of a fleet, with store, limits, users, cluster and partitions of axes, or of a site."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from urllib.parse import quote, urlsplit

from livebode.core import FleetError, on_loopback
from livebode.dataclass import dataclass
from livebode.sources.live import FRAME_BYTES_MAX
from livebode_plant.fleet.fleet_settings import FleetSettings, LeafSection, ServerSection, UsersSection
from livebode_plant.fleet.status_message import NAMES, VIEW
from livebode_plant.fleet.subjects import ACTS_STREAM, API, EDGE, LEVELS, LOG, STATUS_STREAM, VIEW_API, axis_path

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
        tls = _tls("", self.server, authority=False) if self.server.certificate and self.server.key else []
        return [*tls, *(self._accounts(mappings) if self.users.fleet else [mappings])]

    def leaf_lines(self, host: str) -> list[str]:
        """Lines for leaf nodes, which prove by a certificate whose axes they may send."""
        if self.server.leaf_port is None:
            return []
        listen = f"  listen: {json.dumps(f'{host}:{self.server.leaf_port}')}"
        return ["leafnodes {", listen, "  no_advertise: true", *_tls("  ", self.server, "verify_and_map: true"), "}"]

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
        subjects = [f"{EDGE}.{key}" for key in self.axes if f"{axis_path(key)}/".startswith(f"{path}/")]
        if not subjects:
            raise FleetError(
                "axis-unknown",
                f"the fleet has no axis {path!r} and none below it",
                "correct the path in [users.edges], or add the axis to axes",
                axis=path,
            )
        return subjects


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
    users = [f"{{nkey: {key}}}" for key in keys]
    # A name without a password is enough only where a certificate proves it.
    users += [f'{{user: {json.dumps(name)}, allowed_connection_types: ["LEAFNODE"]}}' for name in leaves]
    return "    users: [ " + ", ".join(users) + " ]"


def _service(subject: str, accounts: Sequence[str]) -> str:
    return f"{{service: {json.dumps(subject)}, accounts: {json.dumps(accounts)}}}"


def _import(subject: str, to: str = "") -> str:
    return f"{{service: {{account: {_FLEET}, subject: {json.dumps(subject)}}}{to}}}"


def _list(name: str, entries: Iterable[str]) -> str:
    return "\n".join([f"    {name}: [", *(f"      {entry}" for entry in entries), "    ]"])


@dataclass(frozen=True)
class ClusterMember:
    """A server of the cluster in `server.cluster`, by its number there, which begins with 1."""

    server: ServerSection
    number: int

    def lines(self, host: str) -> list[str]:
        """Lines of the configuration of nats-server, which listens at `host` for the others."""
        tls = _tls("  ", self.server)
        scheme = "tls" if tls else "nats"
        port = self.server.cluster[self.number - 1].rpartition(":")[2]
        return [
            f"server_name: log-{self.number}",
            "cluster {",
            "  name: livebode",
            f"  listen: {json.dumps(f'{host}:{port}')}",
            f"  routes: {json.dumps([f'{scheme}://{address}' for address in self.server.cluster])}",
            "  no_advertise: true",
            *tls,
            "}",
        ]


def cluster_member(settings: FleetSettings, number: int | None) -> ClusterMember | None:
    """The member with this number; None if the fleet has one server.

    Raises
    ------
    FleetError
        If there is no such member, or fewer servers than copies, or if others could join the cluster: off the loopback
        it needs TLS.
    """
    server, replicas = settings.server, settings.log.replicas
    if replicas > max(1, len(server.cluster)):
        raise FleetError(
            "servers-missing",
            f"log.replicas = {replicas} needs {replicas} servers, and server.cluster has {len(server.cluster)}",
            "list the address HOST:PORT of every server in server.cluster",
            replicas=replicas,
        )
    if not server.cluster:
        return None
    if number is None or number > len(server.cluster):
        raise FleetError(
            "member-unknown",
            f"server.cluster has {len(server.cluster)} servers, and it is not known which of them this one is",
            f"give its number there, member = 1 to {len(server.cluster)}",
            servers=len(server.cluster),
        )
    complete = server.certificate and server.key and server.authority
    if not complete and not all(on_loopback(address.rpartition(":")[0]) for address in server.cluster):
        raise FleetError(
            "cluster-open",
            "everyone who reaches the servers of the cluster could join it",
            "set server.certificate, server.key and server.authority",
        )
    return ClusterMember(server, number)


PAYLOAD_BYTES_MAX = 8 << 20
"""Size of one message: the state of an axis with [motion] has 0.65 MB."""
_MEMORY_BYTES = 64 << 20


def server_configuration(
    store: Path,
    *,
    partitions: int,
    port: int,
    host: str,
    file_bytes_max: int,
    access: ServerAccess = OPEN,
    member: ClusterMember | None = None,
) -> str:
    """The text of nats-server's configuration.

    Parameters
    ----------
    store
        Directory of the log.
    partitions
        Number of partitions; it must not change while the log has messages.
    port, host
        Where the server listens.
    file_bytes_max
        Most bytes of all streams. A full disk stops the server without a message, so this must be well below its size.
    access
        Who may do what. Default: everyone everything, for a server on the loopback.
    member
        Which server of a cluster it is. Default: the only one.
    """
    places = ",".join(str(level + 1) for level in range(LEVELS))
    tokens = ".".join(f"{{{{wildcard({level + 1})}}}}" for level in range(LEVELS))
    edge = ".".join([EDGE, *"*" * LEVELS])
    mapped = f"{LOG}.{{{{partition({partitions},{places})}}}}.{tokens}"
    return "\n".join(
        [
            f"listen: {json.dumps(f'{host}:{port}')}",
            f"max_payload: {PAYLOAD_BYTES_MAX}",
            "jetstream {",
            f"  store_dir: {json.dumps(str(store))}",
            f"  max_file_store: {file_bytes_max}",
            f"  max_memory_store: {_MEMORY_BYTES}",
            "}",
            *(member.lines(host) if member else []),
            *access.leaf_lines(host),
            *access.lines(f"mappings = {{ {json.dumps(edge)}: {json.dumps(mapped)} }}"),
            "",
        ]
    )


_SITE = "SITE"
_RECONNECT_S = 1


def leaf_configuration(settings: FleetSettings, *, host: str, port: int) -> str:
    """The text of nats-server's configuration.

    A leaf node stores nothing: an edge has its messages in its buffer until the log has stored them. All its edges are
    one user of the log, which may send the axes of the site.

    Raises
    ------
    FleetError
        If there is no [leaf], or if the leaf node or its way to the log would be open to the network.
    """
    leaf, server = settings.leaf, settings.server
    keys = sorted({key for allowed in settings.users.edges.values() for key in allowed})
    if leaf is None:
        raise FleetError("leaf-missing", "fleet.toml has no [leaf]", "add it, with the url of the log's server")
    _check_closed(leaf, server, keys, host)
    lines = [f"listen: {json.dumps(f'{host}:{port}')}", f"max_payload: {PAYLOAD_BYTES_MAX}"]
    lines += _tls("", server, authority=False)
    if keys:
        users = ", ".join(f"{{nkey: {key}}}" for key in keys)
        lines.append(f"accounts {{ {_SITE} {{ users: [ {users} ] }} }}")
    lines += ["leafnodes {", f"  reconnect: {_RECONNECT_S}", "  remotes: [ {", f"    urls: {json.dumps(leaf.urls)}"]
    lines += [f"    account: {_SITE}"] if keys else []
    lines += _tls("    ", leaf)
    return "\n".join([*lines, "  } ]", "}", ""])


def _check_closed(leaf: LeafSection, server: ServerSection, keys: list[str], host: str) -> None:
    if not on_loopback(host) and not (server.certificate and server.key and keys):
        raise FleetError(
            "server-open",
            f"a server at {host} would be open to everyone who reaches it",
            "set server.certificate, server.key and users.edges; `livebode fleet setup` makes keys",
            host=host,
        )
    for url in leaf.urls:
        encrypted = url.startswith("tls://") and leaf.certificate and leaf.key and leaf.authority
        if not encrypted and not on_loopback(urlsplit(url).hostname or ""):
            raise FleetError(
                "leaf-open",
                f"the log at {url} is reached over a network without mutual TLS",
                "write leaf.url as tls://HOST:PORT, and set leaf.certificate, leaf.key and leaf.authority",
                url=url,
            )


def _tls(indent: str, section: ServerSection | LeafSection, *more: str, authority: bool = True) -> list[str]:
    """The block with the files of a section, and further lines; none without files."""
    files = {"cert_file": section.certificate, "key_file": section.key}
    files |= {"ca_file": section.authority} if authority else {}
    lines = [f"{name}: {json.dumps(str(path.absolute()))}" for name, path in files.items() if path]
    return [f"{indent}tls {{", *(f"{indent}  {line}" for line in (*lines, *more)), f"{indent}}}"] if lines else []
