"""What an OPC UA server offers: its variables of numbers, and how often they change."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator
from typing import Any

import numpy as np

from livebode.core import Block, Channel, SourceError, not_installed
from livebode.sources import split_unit
from livebode.sources.live import HeardChannel, SourceKeys, Survey, nice_rate, parse_address
from livebode_drives.live.opcua import PUBLISH_MS, QUEUE, REQUEST_S

_VARIABLES_MAX, _DEPTH_MAX = 500, 8
_OWN_NAMESPACE = 0  # of the standard: the server's own state


class NodeChanges:
    """Values of each node with the time of the server, as asyncua reports them."""

    def __init__(self) -> None:
        self.of_node: dict[Any, list[tuple[float, list[float]]]] = {}

    def datachange_notification(self, node: Any, value: Any, data: Any) -> None:
        """A node has a new value."""
        stamp = data.monitored_item.Value.SourceTimestamp
        values = value if isinstance(value, list) else [value]
        if stamp is not None and values and all(isinstance(x, bool | int | float) for x in values):
            self.of_node.setdefault(node, []).append((stamp.timestamp(), [float(x) for x in values]))


def survey(settings: SourceKeys, seconds: float) -> Survey:
    """Browse the server at the URL of these settings, and listen to its variables of numbers.

    Raises
    ------
    ExtraError
        If asyncua is not installed.
    SourceError
        If the server cannot be reached or rejects the connection.
    """
    try:
        from asyncua import ua
        from asyncua.client.client import Client
    except ImportError:
        raise not_installed(
            "opc.tcp needs the package asyncua, which is not installed", package="asyncua", extra="opcua"
        ) from None
    logging.getLogger("asyncua").setLevel(logging.CRITICAL)  # its remarks are about its own defaults
    address = str(parse_address(str(settings.url)))
    try:
        return asyncio.run(_survey(Client(address, timeout=REQUEST_S), str(settings.url), seconds))
    except (OSError, ua.UaError) as error:  # type: ignore[attr-defined]
        raise SourceError(
            "no-samples",
            f"the server does not answer ({type(error).__name__}: {error})"[:200],
            "check the address, and whether the server permits anonymous clients",
            address=address,
        ).at(address) from None


async def _survey(client: Any, url: str, seconds: float) -> Survey:
    changes = NodeChanges()
    async with client:
        units: dict[Any, str] = {}
        async for node in _variables(client.nodes.objects, 0):
            units[node] = await _unit(node)
            if len(units) == _VARIABLES_MAX:
                break
        if units:
            subscription = await client.create_subscription(PUBLISH_MS, changes)
            await subscription.subscribe_data_change(list(units), queuesize=QUEUE, sampling_interval=0)
            await asyncio.sleep(seconds)
        names = {node: (await node.read_browse_name()).Name for node in units if node in changes.of_node}
    return _survey_of(url, changes, units, names)


async def _variables(node: Any, depth: int) -> AsyncIterator[Any]:
    from asyncua import ua

    for child in await node.get_children():
        if child.nodeid.NamespaceIndex == _OWN_NAMESPACE:
            continue
        if await child.read_node_class() == ua.NodeClass.Variable:
            yield child
        elif depth < _DEPTH_MAX:
            async for below in _variables(child, depth + 1):
                yield below


async def _unit(node: Any) -> str:
    """The unit that the server states; empty for none."""
    from asyncua import ua

    try:
        unit = await (await node.get_child("0:EngineeringUnits")).read_value()
    except ua.UaError:  # type: ignore[attr-defined]
        return ""
    return str(unit.DisplayName.Text or "")


def _survey_of(url: str, changes: NodeChanges, units: dict[Any, str], names: dict[Any, str]) -> Survey:
    heard, rows, nodes, numbering = [], {}, {}, None
    for node, parts in changes.of_node.items():
        # The first value of a subscription is that which the node had before.
        stamped = sorted(parts[1:])
        row = np.array([value for _, values in stamped for value in values])
        span_s = stamped[-1][0] - stamped[0][0] if len(stamped) > 1 else 0.0
        rate_hz = sum(len(values) for _, values in stamped[1:]) / span_s if span_s > 0 else 0.0
        name, unit = split_unit(names[node])
        unit = units[node] or unit
        heard.append(HeardChannel(node.nodeid.to_string(), unit, rate_hz, parts[-1][1][-1]))
        if rate_hz:
            name = name.rpartition(".")[2]
            heading = f"{name} [{unit}]" if unit else name
            heading = heading if heading not in rows else node.nodeid.to_string()
            rows[heading], nodes[heading] = (row, rate_hz), node.nodeid.to_string()
    if not rows:
        return Survey(tuple(heard), {"url": url}, None, "no variable of numbers changed while it was listened to")
    longest = max(row.size for row, _ in rows.values())
    rate_hz = nice_rate(next(rate for row, rate in rows.values() if row.size == longest))
    for heading, (row, _) in rows.items():
        steps = np.diff(row)
        if row.size < longest and steps.size and np.all(steps == round(longest / row.size)):
            numbering = nodes[heading]
    usable = {heading: row for heading, (row, _) in rows.items() if row.size == longest}
    source: dict[str, Any] = {"url": url, "rate_hz": rate_hz, "nodes": {name: nodes[name] for name in usable}}
    source |= {} if numbering is None else {"sample_node": numbering}
    labels = tuple(Channel(*split_unit(name)) for name in usable)
    return Survey(tuple(heard), source, Block(np.array(list(usable.values())), labels, rate_hz))
