"""Configuration of nats-server for a fleet: its store, its limits, and the mapping of axes to partitions."""

from __future__ import annotations

import json
from pathlib import Path

from livebode_plant.fleet.server_access import OPEN, ServerAccess
from livebode_plant.fleet.server_cluster import ClusterMember
from livebode_plant.fleet.subjects import EDGE, LEVELS, LOG

PAYLOAD_BYTES_MAX = 8 << 20
"""Of one message: the state of an axis with [motion] has 0.65 MB."""
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
