"""Configuration of nats-server for a fleet (its store, its limits, the mapping of axes to partitions), or a site."""

from __future__ import annotations

import json
from pathlib import Path
from urllib.parse import urlsplit

from livebode.core import FleetError, on_loopback
from livebode_plant.fleet.fleet_settings import FleetSettings, LeafSection, ServerSection
from livebode_plant.fleet.server_access import OPEN, ServerAccess
from livebode_plant.fleet.server_cluster import ClusterMember
from livebode_plant.fleet.subjects import EDGE, LEVELS, LOG

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
    lines += _tls("", {"cert_file": server.certificate, "key_file": server.key})
    if keys:
        users = ", ".join(f"{{nkey: {key}}}" for key in keys)
        lines.append(f"accounts {{ {_SITE} {{ users: [ {users} ] }} }}")
    lines += ["leafnodes {", f"  reconnect: {_RECONNECT_S}", "  remotes: [ {", f"    urls: {json.dumps(leaf.urls)}"]
    lines += [f"    account: {_SITE}"] if keys else []
    lines += _tls("    ", {"cert_file": leaf.certificate, "key_file": leaf.key, "ca_file": leaf.authority})
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


def _tls(indent: str, files: dict[str, Path | None]) -> list[str]:
    lines = [f"{indent}  {name}: {json.dumps(str(path.absolute()))}" for name, path in files.items() if path]
    return [f"{indent}tls {{", *lines, f"{indent}}}"] if lines else []
