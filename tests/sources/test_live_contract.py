"""What every live source must hold, each against a real peer. A new kind needs a line in a table and a peer here."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from livebode.core import SourceError
from livebode.plugins import named
from livebode.sources.live import KINDS, LiveBlock, LiveSource
from tests.support.errors import refused
from tests.support.peers.broker import Mqtt311Peer, MqttPeer
from tests.support.peers.can_bus import CanPeer
from tests.support.peers.opcua import OpcUaPeer
from tests.support.peers.peer import (
    CHANNELS,
    PATIENCE_S,
    RATE_HZ,
    SAMPLES,
    Peer,
    batches,
    fed,
    opened,
    send_all,
)
from tests.support.peers.plain import StdinPeer, TcpPeer, UdpPeer
from tests.support.peers.plc import NotifyPeer, RingPeer
from tests.support.peers.serial_line import SerialFramesPeer, SerialJsonPeer, SerialNumbersPeer

PEERS = {
    "udp": UdpPeer,
    "tcp": TcpPeer,
    "stdin": StdinPeer,
    "mqtt": MqttPeer,
    "mqtt-3.1.1": Mqtt311Peer,
    "opc.tcp": OpcUaPeer,
    "ads-ring": RingPeer,
    "ads-notify": NotifyPeer,
    "serial-numbers": SerialNumbersPeer,
    "serial-frames": SerialFramesPeer,
    "serial-json": SerialJsonPeer,
    "can-counter": CanPeer,
}


@pytest.fixture(params=PEERS)
def peer(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Peer]:
    with PEERS[request.param](tmp_path) as found:
        yield found


def received(source: LiveSource, last: int) -> list[LiveBlock]:
    """Blocks up to the sender's sample `last`; a source that falls silent is closed, and the test fails."""
    blocks: list[LiveBlock] = []
    timer = threading.Timer(PATIENCE_S, source.stop)
    timer.start()
    for block in source.blocks():
        blocks.append(block)
        if block["w"][-1] == last:
            break
    timer.cancel()
    assert blocks
    assert blocks[-1]["w"][-1] == last
    return blocks


def is_truth(blocks: list[LiveBlock]) -> None:
    """Every sample is the one that its number says, and gaps are flagged where numbers jump."""
    first = blocks[0]["w"][0]
    for block in blocks:
        np.testing.assert_array_equal(block["w"], first + np.arange(block.start, block.stop))
    for a, b in pairwise(blocks):
        assert b.gap == (b.start > a.stop)


def test_every_kind_has_a_peer():
    # These do not send what a test gives them: test_klipper_truth.py, test_daq_truth.py, test_hal_truth.py of the wing.
    own = {"klipper", "daqref", "daq.nd", "hal"}
    assert {name.split("-")[0] for name in PEERS} | {"mqtts"} | own == named("sources").keys()


def test_the_same_samples_come_back_bit_for_bit(peer):
    given, looked = batches(60), threading.Event()

    def script() -> None:
        peer.wait_ready()
        send_all(peer, given)
        # A source whose sender has ended is no longer connected.
        looked.wait(PATIENCE_S)
        peer.end()

    with fed(peer, script, **({"reorder_batches": 0} if "udp" in peer.settings["url"] else {})) as source:
        blocks = received(source, given[-1].stop - 1)
        assert source.channels == CHANNELS
        assert source.rate_hz == RATE_HZ
        assert source.samples is None
        assert source.health.connected
        looked.set()
        assert source.health.lost == 0
        events = source.take_events()
    is_truth(blocks)
    truth = np.concatenate([batch.data for batch in given], axis=1)
    found = np.concatenate([block.data for block in blocks], axis=1)
    np.testing.assert_array_equal(found[:, -truth.shape[1] :], truth)
    assert not any(block.gap for block in blocks)
    assert np.all(np.diff([block.arrived_s for block in blocks]) >= 0)
    assert blocks[0].start == 0
    assert blocks[0].channels == CHANNELS
    assert [event.kind for event in events] == ["connected"]


def test_lost_samples_are_a_gap_of_their_length(peer):
    given = batches(140)

    def script() -> None:
        peer.wait_ready()
        send_all(peer, given[:40])
        peer.lose(given[40:100])
        send_all(peer, given[100:])
        peer.end()

    with fed(peer, script) as source:
        blocks = received(source, given[-1].stop - 1)
        events = [event for event in source.take_events() if event.kind == "loss"]
        lost = source.health.lost
    is_truth(blocks)
    assert lost == sum(event.details["missing_samples"] for event in events) > 0
    assert lost == blocks[-1].stop - sum(map(len, blocks))
    assert [event.sample for event in events] == [block.start for block in blocks if block.gap]
    if "ads://" not in peer.settings["url"] or peer.settings.get("mode") == "notify":
        assert lost == 60 * SAMPLES


@pytest.mark.parametrize("peer", [name for name, kind in PEERS.items() if kind.reconnects], indirect=True)
def test_a_broken_connection_is_connected_again(peer):
    given = batches(60)

    def script() -> None:
        peer.wait_ready()
        send_all(peer, given[:30])
        peer.interrupt()
        send_all(peer, given[30:])

    with fed(peer, script) as source:
        blocks = received(source, given[-1].stop - 1)
        kinds = [event.kind for event in source.take_events()]
    is_truth(blocks)
    assert [kind for kind in kinds if kind in ("connected", "disconnected")][:3] == [
        "connected", "disconnected", "connected",
    ]  # fmt: skip


def test_rubbish_is_counted_and_the_stream_continues(peer):
    given = batches(60)

    def script() -> None:
        peer.wait_ready()
        send_all(peer, given[:30])
        for _ in range(3):
            peer.send_rubbish()
        send_all(peer, given[30:])
        peer.end()

    with fed(peer, script) as source:
        is_truth(received(source, given[-1].stop - 1))
        events = source.take_events()
    assert source.health.counts["malformed"] >= 1
    assert {event.kind for event in events} <= set(KINDS)
    assert all("\n" not in event.message for event in events)


@pytest.mark.parametrize("peer", [name for name, kind in PEERS.items() if kind.numbers_begin_anew], indirect=True)
def test_a_sender_that_starts_again_is_a_restart(peer):
    old, new = batches(60, first=10_000_000), batches(60, first=0)

    def script() -> None:
        peer.wait_ready()
        send_all(peer, old)
        send_all(peer, new)
        peer.end()

    with fed(peer, script) as source:
        blocks = received(source, new[-1].stop - 1)
        kinds = [event.kind for event in source.take_events()]
    assert kinds.count("restart") == 1
    at = next(i for i, block in enumerate(blocks) if block["w"][0] < 1_000_000)
    is_truth(blocks[:at])
    assert blocks[at].gap
    assert blocks[at].start == blocks[at - 1].stop
    np.testing.assert_array_equal(np.concatenate([block["w"] for block in blocks[at:]]), np.arange(60 * SAMPLES))


def test_stop_ends_the_blocks_and_a_misspelt_channel_is_named(peer):
    given, sent = batches(60), threading.Event()

    def script() -> None:
        peer.wait_ready()
        send_all(peer, given)
        sent.set()

    def stop() -> None:
        sent.wait(PATIENCE_S)  # before, a sender would lose its receiver
        source.stop()

    with fed(peer, script) as source:
        with pytest.raises(SourceError) as caught:
            source.blocks(["W"])
        assert (caught.value.code, caught.value.channel) == ("source.channel-unknown", "W")
        assert caught.value.remedy.startswith("did you mean 'w'?")
        stopping = threading.Thread(target=stop)
        stopping.start()
        for block in source.blocks(["y"]):
            assert block.names == ("y",)
        stopping.join()


def test_a_silent_source_is_refused_after_its_timeout(peer):
    with refused(SourceError, "no-samples", timeout_s=0.3):
        opened(peer, timeout_s=0.3)
