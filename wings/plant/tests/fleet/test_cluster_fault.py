"""A log in three copies on three real servers: the loss of one, and the fence between two owners."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from pathlib import Path

import pytest

from livebode.core import FleetError
from livebode_plant.fleet.fleet_settings import FleetSettings
from livebode_plant.fleet.log import ClaimLostError, FleetLog
from livebode_plant.fleet.server_config import cluster_member
from livebode_plant.fleet.subjects import LOG_STREAM, RESULT_STREAM, RESULTS
from tests.support.command import livebode
from tests.support.fleet_runs import PARTITIONS, checked, fleet_axes, owned_until_current, sent
from tests.support.log_cluster import LogCluster, log_cluster

PAIRS = 100


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[LogCluster]:
    with log_cluster(tmp_path) as one:
        yield one


def test_the_loss_of_the_server_that_leads_costs_no_message_and_no_response(cluster: LogCluster) -> None:
    axes = fleet_axes(3)
    sent(cluster.log, axes, 20)
    owned_until_current(cluster.log, axes)
    for part, stream in enumerate((LOG_STREAM, RESULT_STREAM), start=1):
        lost = cluster.leader(stream)
        lost.kill()
        sent(cluster.log, axes, 20, 20 * part)
        owned_until_current(cluster.log, axes, responses=3 * 20 * (part + 1) * 2)
        lost.start()
    result = checked(cluster.log, axes)
    assert result.exact
    assert result.messages == 3 * 60
    assert result.total.responses == 3 * 60 * 2
    assert result.claims == 3 * PARTITIONS


def test_of_two_owners_that_write_at_the_same_moment_one_is_refused(cluster: LogCluster) -> None:
    stored, refused = asyncio.run(_race(cluster))
    assert refused == PAIRS
    assert stored == PAIRS


async def _race(cluster: LogCluster) -> tuple[int, int]:
    """Pairs of writes after the same message, by connections to two servers; how many are stored and refused."""
    one, other, _ = cluster.log.url.split(",")
    refused = 0
    async with (
        FleetLog(cluster.log.model_copy(update={"url": one}), "one") as first,
        FleetLog(cluster.log.model_copy(update={"url": other}), "other") as second,
    ):
        after = 0
        for _ in range(PAIRS):
            outcomes = await asyncio.gather(
                *(log.append_after(RESULT_STREAM, f"{RESULTS}.0", b"results", after) for log in (first, second)),
                return_exceptions=True,
            )
            refused += sum(isinstance(outcome, ClaimLostError) for outcome in outcomes)
            (after,) = [outcome for outcome in outcomes if isinstance(outcome, int)]
        return (await first.extent(RESULT_STREAM)).last, refused


def _settings(**over: object) -> FleetSettings:
    return FleetSettings.of({"axes": ["a.toml"], **over}, "fleet.toml")


def test_copies_need_servers_a_member_a_number_and_a_network_certificates() -> None:
    loopback = [f"127.0.0.1:{port}" for port in (6222, 6223, 6224)]
    with pytest.raises(FleetError, match=r"log.replicas = 3 needs 3 servers, and server.cluster has 0"):
        cluster_member(_settings(log={"replicas": 3}), None)
    several = _settings(log={"replicas": 3}, server={"cluster": loopback})
    for number in (None, 4):
        with pytest.raises(FleetError, match="give its number there, member = 1 to 3"):
            cluster_member(several, number)
    with pytest.raises(FleetError, match=r"could join it; set server\.certificate"):
        cluster_member(_settings(server={"cluster": ["log1.plant:6222", *loopback[1:]]}), 1)
    assert cluster_member(_settings(), None) is None


def test_the_command_writes_the_configuration_of_each_member(tmp_path: Path) -> None:
    fleet = tmp_path / "fleet.toml"
    fleet.write_text('axes = ["a.toml"]\n[log]\nreplicas = 2\n[server]\ncluster = ["127.0.0.1:6222", "127.0.0.1:6223"]')
    text = livebode("fleet", "setup", fleet, "--member", "2").out
    assert "server_name: log-2" in text
    assert 'listen: "127.0.0.1:6223"' in text
    assert 'routes: ["nats://127.0.0.1:6222", "nats://127.0.0.1:6223"]' in text
