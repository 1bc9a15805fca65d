"""Edges behind the leaf node of their site, on real servers with mutual TLS: what passes, and a cut of the link."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path

import pytest
from nats.errors import Error

from livebode.core import FleetError
from livebode_plant.fleet.connection import security
from livebode_plant.fleet.edge import Edge, send_edges
from livebode_plant.fleet.edge_buffer import EdgeBuffer
from livebode_plant.fleet.encrypted_client import EncryptedClient
from livebode_plant.fleet.fleet_settings import FleetSettings, LogSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.server import NatsServer, free_port
from livebode_plant.fleet.server_config import leaf_configuration
from livebode_plant.fleet.subjects import EDGE, LOG, LOG_STREAM
from tests.support.command import livebode
from tests.support.fleet_runs import batch, checked, owned_until_current
from tests.support.secure_fleet import LEAF, SecureFleet, secure_fleet_with_streams


@pytest.fixture
def fleet(tmp_path: Path) -> Iterator[SecureFleet]:
    with secure_fleet_with_streams(tmp_path) as one:
        yield one


def _settings(fleet: SecureFleet, name: str) -> FleetSettings:
    leaf = {
        "url": f"tls://127.0.0.1:{fleet.access.server.leaf_port}",
        "certificate": f"{name}.pem",
        "key": f"{name}-key.pem",
        "authority": "authority.pem",
    }
    return FleetSettings.of({"axes": ["a.toml"], "leaf": leaf}, "fleet.toml").beside(fleet.folder)


@contextmanager
def _leaf(fleet: SecureFleet, name: str = LEAF) -> Iterator[LogSection]:
    """A leaf node of the site, and the settings of an edge behind it."""
    port = free_port()
    text = leaf_configuration(_settings(fleet, name), host="127.0.0.1", port=port)
    with NatsServer(fleet.folder / name, port, text):
        yield LogSection(url=f"nats://127.0.0.1:{port}", access="send")


def test_an_edge_behind_a_leaf_node_is_tracked_and_a_cut_of_the_link_loses_nothing(fleet: SecureFleet) -> None:
    own, _ = fleet.keys
    buffer = EdgeBuffer(fleet.folder / "buffer", 1 << 20)
    edge, taking = Edge(own, buffer), Future[None]()

    async def outage(settings: LogSection) -> None:
        sending = asyncio.create_task(send_edges(settings, [(edge, taking)], threading.Event()))
        for first in range(0, 1000, 50):
            edge.add(batch(0, first))
        while edge.sent < 5:
            await asyncio.sleep(0.02)
        await asyncio.to_thread(fleet.server.kill)
        for first in range(1000, 2000, 50):
            edge.add(batch(0, first))
        await asyncio.to_thread(fleet.server.start)
        taking.set_result(None)
        await sending

    with _leaf(fleet) as settings:
        asyncio.run(outage(settings))
    assert edge.sent == 40
    buffer.close()
    owned_until_current(fleet.log("fleet"), fleet.axes)
    result = checked(fleet.log("fleet"), fleet.axes)
    assert result.exact
    assert (result.messages, result.total.responses) == (40, 40 * 2)


def test_a_leaf_node_may_send_the_axes_of_its_site_and_nothing_else(fleet: SecureFleet) -> None:
    own, other = fleet.keys

    async def attack(settings: LogSection) -> None:
        async with FleetLog(settings, "test") as log:
            await log.append(f"{EDGE}.{own}", b"first")
            for subject in (f"{EDGE}.{other}", f"{LOG}.0.{own}", "res.0", "$JS.API.STREAM.PURGE.LOG"):
                with pytest.raises((Error, TimeoutError)):
                    await log._js.publish(subject, b"forged", timeout=1)
            await log._connection.publish(f"{EDGE}.{own}", b"forged", reply="$JS.API.STREAM.PURGE.LOG")
            await log.append(f"{EDGE}.{own}", b"last")

    with _leaf(fleet) as settings:
        asyncio.run(attack(settings))
    assert asyncio.run(_stored(fleet)) == {own: 3}


def test_a_leaf_node_with_a_certificate_that_is_not_named_does_not_reach_the_log(fleet: SecureFleet) -> None:
    own, _ = fleet.keys

    async def send(settings: LogSection) -> None:
        async with FleetLog(settings, "test") as log:
            with pytest.raises((Error, TimeoutError)):
                await log._js.publish(f"{EDGE}.{own}", b"forged", timeout=2)

    with _leaf(fleet, "stranger.leaf") as settings:
        asyncio.run(send(settings))
    assert asyncio.run(_stored(fleet)) == {}


def test_the_name_of_a_leaf_node_is_no_user_for_others(fleet: SecureFleet) -> None:
    without = fleet.log("edge 0").model_copy(update={"credentials": None})

    async def connect() -> None:

        client = EncryptedClient()
        await client.connect(
            fleet.server.url, user=LEAF, password="", allow_reconnect=False, connect_timeout=2, **security(without)
        )

    with pytest.raises((Error, TimeoutError)):
        asyncio.run(connect())


def test_a_leaf_node_is_closed_to_the_network_and_so_is_its_way_to_the_log(fleet: SecureFleet, tmp_path: Path) -> None:
    settings = _settings(fleet, LEAF)
    with pytest.raises(FleetError, match="would be open to everyone who reaches it"):
        leaf_configuration(settings, host="0.0.0.0", port=4222)
    with pytest.raises(FleetError, match=r"has no \[leaf\]"):
        leaf_configuration(settings.model_copy(update={"leaf": None}), host="127.0.0.1", port=4222)
    (tmp_path / "site.toml").write_text('axes = ["a.toml"]\n[leaf]\nurl = "tls://log.plant:7422"')
    refused = livebode("fleet", "setup", tmp_path / "site.toml", "--leaf")
    assert (refused.code, "without mutual TLS; write leaf.url as tls://" in refused.err) == (2, True)


async def _stored(fleet: SecureFleet) -> dict[str, int]:
    async with FleetLog(fleet.log("fleet"), "test") as log:
        extent = await log.extent(LOG_STREAM, f"{LOG}.>")
        return {subject.split(".", 2)[2]: count for subject, count in extent.subjects.items()}
