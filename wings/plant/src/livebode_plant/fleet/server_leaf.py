"""Configuration of the nats-server of a site: a leaf node, which passes the messages of its edges on to the log."""

from __future__ import annotations

import json
from pathlib import Path
from urllib.parse import urlsplit

from livebode.core import FleetError, on_loopback
from livebode_plant.fleet.server_config import PAYLOAD_BYTES_MAX
from livebode_plant.fleet.settings import FleetSettings, LeafSection, ServerSection

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
