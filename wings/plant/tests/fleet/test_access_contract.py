"""What each user of a log may do, on a real server with TLS: edges, workers, viewers, strangers."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import stat
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path

import pytest
import trustme
from nats.errors import Error, NoRespondersError
from nats.js.errors import NoStreamResponseError, ServiceUnavailableError

from livebode.core import ConfigError, FleetError
from livebode_plant.fleet.connection import write_credentials
from livebode_plant.fleet.fleet_settings import FleetSettings, LogSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.message import message_id, write_message
from livebode_plant.fleet.server import LogServer
from livebode_plant.fleet.status import fleet_status
from livebode_plant.fleet.status_message import VIEW
from livebode_plant.fleet.subjects import ACTS, EDGE, LOG, LOG_STREAM, RESULTS, STATUS, STATUS_STREAM, axis_path
from livebode_plant.page.fleet_board import FleetAct
from livebode_plant.page.fleet_feed import NatsFeed
from tests.support.command import livebode
from tests.support.fleet_runs import PARTITIONS, batch
from tests.support.secure_fleet import SecureFleet, secure_fleet_with_streams

SILENCE_S = 0.3


@pytest.fixture
def fleet(tmp_path: Path) -> Iterator[SecureFleet]:
    with secure_fleet_with_streams(tmp_path) as one:
        yield one


def _as(settings: LogSection, action: Callable[[FleetLog], Awaitable[object]]) -> None:
    async def run() -> None:
        async with FleetLog(settings, "test") as log:
            await action(log)

    asyncio.run(run())


async def _until(
    happened: Callable[[], object], jobs: list[asyncio.Task[None]], doing: Callable[[], Awaitable[None]] | None = None
) -> None:
    """Wait, `doing` something repeatedly; a job that has ended raises why."""
    while not happened():
        for job in jobs:
            if job.done():
                job.result()
        if doing is not None:
            await doing()
        await asyncio.sleep(0.05)


def _stored(fleet: SecureFleet) -> dict[str, int]:
    """Messages of the log by their subject, without the partition."""
    found: dict[str, int] = {}

    async def read(log: FleetLog) -> None:
        extent = await log.extent(LOG_STREAM, f"{LOG}.>")
        found.update({subject.split(".", 2)[2]: count for subject, count in extent.subjects.items()})

    _as(fleet.log("fleet"), read)
    return found


def test_an_edge_stores_messages_of_its_own_axis_and_of_no_other(fleet: SecureFleet) -> None:
    own, other = fleet.keys

    async def send(log: FleetLog) -> None:
        message = write_message(batch(0, 0))
        await log.append(f"{EDGE}.{own}", message, message_id(own, message))
        for subject in (
            f"{EDGE}.{other}",
            f"{LOG}.0.{own}",
            f"{EDGE}.ulm._.press%209.x",
            f"{RESULTS}.0",
            f"{STATUS}.0",
        ):
            with pytest.raises(NoStreamResponseError):
                await log._js.publish(subject, b"forged", timeout=1)

    _as(fleet.log("edge 0"), send)
    assert _stored(fleet) == {own: 1}


def test_an_edge_reads_nothing_and_has_no_request_of_jetstream(fleet: SecureFleet) -> None:
    _, other = fleet.keys
    heard: list[str] = []

    async def spy(log: FleetLog) -> None:
        client = log._connection
        for request in ("STREAM.DELETE.LOG", "STREAM.PURGE.LOG", "STREAM.INFO.LOG", "STREAM.NAMES", "INFO"):
            with contextlib.suppress(NoRespondersError):
                answer = await client.request(f"$JS.API.{request}", timeout=1)
                assert json.loads(answer.data)["error"]["description"] == "JetStream not enabled for account"

        async def hear(message: object) -> None:
            heard.append(str(message))

        await client.subscribe(">", cb=hear)
        await client.flush()
        async with FleetLog(fleet.log("fleet"), "test") as workers, FleetLog(fleet.log("edge 1"), "test") as neighbour:
            await neighbour.append(f"{EDGE}.{other}", write_message(batch(1, 0)))
            await workers.append(f"{RESULTS}.0", b"results")
            await workers.last(LOG_STREAM, f"{LOG}.*.{other}")
        await asyncio.sleep(SILENCE_S)

    _as(fleet.log("edge 0"), spy)
    assert [one for one in heard if "results" in one or other in one] == []
    assert _stored(fleet) == {other: 1}


def test_an_acknowledgement_sent_to_a_request_of_jetstream_deletes_nothing(fleet: SecureFleet) -> None:
    own, _ = fleet.keys

    async def attack(log: FleetLog) -> None:
        for number in range(3):
            await log.append(f"{EDGE}.{own}", b"%d" % number)
        for reply in ("$JS.API.STREAM.PURGE.LOG", "$JS.API.STREAM.DELETE.LOG", f"{RESULTS}.0"):
            await log._connection.publish(f"{EDGE}.{own}", b"forged", reply=reply)
        await log._connection.flush()
        await log.append(f"{EDGE}.{own}", b"last")

    _as(fleet.log("edge 0"), attack)
    assert _stored(fleet) == {own: 7}


def test_an_edge_cannot_remove_messages_by_headers_or_make_the_log_drop_those_of_another(fleet: SecureFleet) -> None:
    own, other = fleet.keys
    message = write_message(batch(1, 0))

    async def attack(log: FleetLog) -> None:
        await log.append(f"{EDGE}.{own}", b"first")
        for scope in ("sub", "all"):
            with contextlib.suppress(Error):
                await log._js.publish(f"{EDGE}.{own}", b"x", headers={"Nats-Rollup": scope}, timeout=1)
        before = message_id(other, message).rpartition(":")[0]
        await log.append(f"{EDGE}.{own}", b"forged", before)

    async def send(log: FleetLog) -> None:
        await log.append(f"{EDGE}.{other}", message, message_id(other, message))
        await log.append(f"{EDGE}.{other}", message, message_id(other, message))

    _as(fleet.log("edge 0"), attack)
    _as(fleet.log("edge 1"), send)
    assert _stored(fleet) == {own: 2, other: 1}


def test_a_viewer_reads_the_status_and_changes_nothing(fleet: SecureFleet) -> None:
    own, _ = fleet.keys
    about = {"partition": 0, "owner": "a:1", "at_s": 0.0, "waiting": 0, "unknown": {}, "axes": {}}

    async def report(log: FleetLog) -> None:
        await log.append(f"{STATUS}.0", json.dumps(about).encode())

    async def look(log: FleetLog) -> None:
        assert [one["owner"] for one in (await fleet_status(log, fleet.axes))["partitions"]] == ["a:1"]
        impatient = log._connection.jetstream(timeout=SILENCE_S, prefix=log._api)  # the server does not answer
        for subject in (f"{STATUS}.0", f"{EDGE}.{own}", f"{LOG}.0.{own}", f"{RESULTS}.0", f"{ACTS}.acknowledge.{own}"):
            with pytest.raises((NoStreamResponseError, TimeoutError)):
                await impatient.publish(subject, b"forged")
        with pytest.raises((ServiceUnavailableError, TimeoutError)):
            await impatient.purge_stream(STATUS_STREAM)
        with pytest.raises((ServiceUnavailableError, TimeoutError)):
            await impatient.pull_subscribe(f"{STATUS}.0", stream=STATUS_STREAM)
        with pytest.raises((ServiceUnavailableError, TimeoutError)):
            await impatient.get_msg(LOG_STREAM, 1)
        for reply in (f"{LOG}.0.{own}", "$JS.API.STREAM.PURGE.STATUS"):
            await log._connection.publish("viewer.STREAM.INFO.STATUS", b"", reply=reply)
        await log._connection.flush()
        assert (await log.extent(STATUS_STREAM)).subjects == {f"{STATUS}.0": 1}

    async def page() -> list[bytes]:
        heard: list[bytes] = []
        view = fleet.log("view", "view")
        feed = NatsFeed(view, "fleet")
        running = asyncio.create_task(feed.run(heard.append, heard.append))
        async with FleetLog(fleet.log("fleet"), "test") as log:
            await _until(lambda: heard, [running], lambda: log._connection.publish(f"{VIEW}.0", b"page"))
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)
        return heard

    _as(fleet.log("fleet"), report)
    _as(fleet.log("view", "view"), look)
    assert asyncio.run(page())[0] == b"page"
    assert _stored(fleet) == {}


def test_a_viewer_reads_acknowledgements_and_writes_none(fleet: SecureFleet) -> None:
    path = axis_path(fleet.keys[0])
    stored, later = (FleetAct("acknowledge", path, raised, 0, by="Ada").to_bytes() for raised in (1, 2))

    async def page() -> list[bytes]:
        heard: list[bytes] = []
        shown: list[bytes] = []
        writer, view = fleet.log("fleet"), fleet.log("view", "view")
        operator = NatsFeed(writer, "fleet")
        viewer = NatsFeed(view, "fleet")
        own = FleetAct.of(stored)
        assert own is not None
        for feed in (operator, viewer):
            await feed.connect()
        jobs = [asyncio.create_task(feed.run(shown.append, heard.append)) for feed in (operator, viewer)]

        async def acknowledge() -> None:
            with contextlib.suppress(FleetError):  # there is no stream yet
                await operator.publish(own)

        await _until(lambda: heard, jobs, acknowledge)
        await _until(lambda: heard.count(stored) >= 2, jobs)
        with pytest.raises(FleetError, match="key of a viewer"):
            await viewer.publish(own)
        for subject in (f"{VIEW}.0", f"{ACTS}.acknowledge.x"):  # to other viewers, and to the log
            await viewer._connection.publish(subject, b"forged")
        await viewer._connection.flush()
        await operator.publish(FleetAct("acknowledge", path, 2, 0, by="Ada"))
        await _until(lambda: heard.count(later) >= 2, jobs)
        for job in jobs:
            job.cancel()
        await asyncio.gather(*jobs, return_exceptions=True)
        return heard + shown

    assert b"forged" not in asyncio.run(page())


def test_a_key_that_is_not_among_the_users_is_refused_with_its_file(fleet: SecureFleet) -> None:
    with pytest.raises(FleetError, match=r"does not accept the key .*stranger") as caught:
        _as(fleet.log("stranger"), _nothing)
    assert caught.value.code == "fleet.log-refused"
    without = fleet.log("fleet").model_copy(update={"credentials": None})
    with pytest.raises(FleetError, match=r"needs a key; set log\.credentials"):
        _as(without, _nothing)


def test_a_server_of_an_unknown_authority_is_refused(fleet: SecureFleet, tmp_path: Path) -> None:
    trustme.CA().cert_pem.write_to_path(tmp_path / "other.pem")
    with pytest.raises(FleetError, match="is not trusted") as caught:
        _as(fleet.log("fleet").model_copy(update={"authority": tmp_path / "other.pem"}), _nothing)
    assert caught.value.code == "fleet.log-untrusted"
    with pytest.raises(FleetError, match=r"set log\.authority"):
        _as(fleet.log("fleet").model_copy(update={"authority": tmp_path / "fleet"}), _nothing)


def test_a_server_without_tls_is_refused_where_tls_is_demanded(tmp_path: Path) -> None:
    with LogServer(tmp_path, PARTITIONS) as server, pytest.raises(FleetError, match="does not offer TLS"):
        _as(LogSection(url=server.url.replace("nats://", "tls://")), _nothing)


async def _nothing(log: FleetLog) -> None:
    raise AssertionError(f"connected to {log.settings.url}")


def test_a_removed_key_ends_the_connection_and_a_second_one_replaces_it(fleet: SecureFleet) -> None:
    own, _ = fleet.keys
    new = write_credentials(fleet.folder / "edge 0 new")
    configuration = fleet.folder / "log" / "nats.conf"
    text = configuration.read_text()
    (old,) = [line for line in text.splitlines() if "nkey" in line and _public(fleet.folder / "edge 0") in line]

    async def rotate(log: FleetLog) -> None:
        await log.append(f"{EDGE}.{own}", b"old")
        configuration.write_text(text.replace(old, f"    users: [ {{nkey: {new}}} ]"))
        fleet.server.reload()
        while log._connection.is_connected:
            await asyncio.sleep(0.02)
        async with FleetLog(fleet.log("edge 0 new"), "test") as other:
            await other.append(f"{EDGE}.{own}", b"new")

    _as(fleet.log("edge 0"), rotate)
    with pytest.raises(FleetError, match="does not accept the key"):
        _as(fleet.log("edge 0"), _nothing)
    assert _stored(fleet) == {own: 2}


def _public(path: Path) -> str:
    import nkeys

    public: bytes = nkeys.from_seed(bytearray(path.read_bytes().strip())).public_key
    return public.decode()


@pytest.mark.parametrize("url", ["nats://log.example:4222", "nats://10.0.0.1", "tls://a:1,nats://127.0.0.1:2"])
def test_a_log_on_a_network_without_tls_is_refused(url: str) -> None:
    with pytest.raises(ConfigError, match=r"over a network without TLS; write log\.url as tls://"):
        FleetSettings.of({"axes": ["a.toml"], "log": {"url": url}}, "fleet.toml")


def test_a_password_in_the_address_is_refused_and_not_shown() -> None:
    with pytest.raises(ConfigError) as caught:
        FleetSettings.of({"axes": ["a.toml"], "log": {"url": "tls://me:hunter2@log.example:4222"}}, "fleet.toml")
    assert caught.value.code == "config.secret-in-url"
    assert "hunter2" not in str(caught.value)


def test_a_key_is_a_file_of_this_user_alone_and_never_shown(tmp_path: Path) -> None:
    made = livebode("fleet", "setup", "--user", "edge:Graz/2", "--out", tmp_path)
    path = tmp_path / "edge-Graz%2F2.nkey"
    secret = path.read_text().strip()
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert f'[users.edges]\n"Graz/2" = ["{_public(path)}"]' in made.out
    assert secret not in made.out + made.err
    again = livebode("fleet", "setup", "--user", "edge:Graz/2", "--out", tmp_path)
    assert (again.code, "File exists" in again.err) == (2, True)
    assert path.read_text().strip() == secret
    os.chmod(path, 0o640)
    with pytest.raises(FleetError, match="chmod 600"):
        _as(LogSection(credentials=path), _nothing)
    path.chmod(0o600)
    path.write_text("S" + secret)
    with pytest.raises(FleetError, match="has no secret key") as caught:
        _as(LogSection(credentials=path), _nothing)
    assert secret not in str(caught.value)


def test_a_server_on_a_network_needs_tls_and_keys(tmp_path: Path) -> None:
    fleet = tmp_path / "fleet.toml"
    fleet.write_text('axes = ["axis.toml"]')
    refused = livebode("fleet", "setup", fleet, "--host", "0.0.0.0")
    assert refused.code == 2
    assert "would be open to everyone who reaches it; set server.certificate" in refused.err
    public = write_credentials(tmp_path / "key")
    fleet.write_text(
        f'axes = ["axis.toml"]\n[server]\ncertificate = "a.pem"\nkey = "b.pem"\n[users]\nfleet = ["{public}"]'
    )
    text = livebode("fleet", "setup", fleet, "--host", "0.0.0.0").out
    assert f'cert_file: "{tmp_path / "a.pem"}"' in text
    assert f"{{nkey: {public}}}" in text
