"""An MQTT broker receives what is recorded, whatever becomes of the connection, and however little it sends at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
from paho.mqtt import client as mqtt
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

from livebode.records import RunRecord
from livebode_drives.live.mqtt import ANSWER_S, InFlight
from tests.support.live_session import LiveSession
from tests.support.peers.broker import Mqtt311Peer, MqttPeer, Nats
from tests.support.peers.peer import batches, until

NAME = "livebode"


class OneAtATime(Nats):
    """Sends a message only after the one before is acknowledged."""

    def written(self, lines: tuple[str, ...], folder: Path) -> str:
        return super().written(lines, folder).replace("mqtt {", "mqtt { max_ack_pending: 1,")


class OneAtATimePeer(Mqtt311Peer):
    broker = OneAtATime


def sent_again(port: int) -> None:
    """Another client takes the session, receives, acknowledges nothing, and goes."""
    session = Properties(PacketTypes.CONNECT)
    session.SessionExpiryInterval = 3600
    client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, NAME, protocol=mqtt.MQTTv5, manual_ack=True)
    client.connect("127.0.0.1", port, clean_start=False, properties=session)
    client.loop_start()
    until(client.is_connected, "the other client to be connected")
    client.disconnect()
    client.loop_stop()


def tracked(session: LiveSession) -> int | None:
    source = session.control.source
    return None if source is None else source._sequencer._next


def check_whole(folder: Path, last: int) -> None:
    run = RunRecord.open(folder / "run")
    numbers = np.concatenate([pa.table(table)["w"].to_numpy() for table in run.tables("samples")])
    assert np.array_equal(numbers, numbers[0] + np.arange(numbers.size))
    assert numbers[-1] == last
    assert not {"loss", "restart", "overflow"} & {event.kind for event in run.events()}


def test_a_session_that_is_taken_over_loses_and_doubles_nothing(tmp_path: Path) -> None:
    given = batches(240)
    with MqttPeer(tmp_path) as peer:
        peer.settings |= {"client_id": NAME}
        with LiveSession(tmp_path, peer, record={"samples": True}) as session:
            peer.wait_ready()
            for number, batch in enumerate(given):
                peer.send(batch)
                if number % 60 == 50:  # more than the repeats that would be taken for a restart
                    sent_again(peer._broker.port)
            until(lambda: tracked(session) == given[-1].stop, "all to be tracked")
    check_whole(tmp_path, given[-1].stop - 1)


def test_a_broker_that_sends_one_message_at_a_time_does_not_wait_for_the_next_commit(tmp_path: Path) -> None:
    given = batches(700)  # by commits alone more than the test would wait
    with OneAtATimePeer(tmp_path) as peer:
        peer.settings |= {"client_id": NAME}
        with LiveSession(tmp_path, peer, record={"samples": True}) as session:
            peer.wait_ready()
            for batch in given:
                peer.send(batch)
            until(lambda: tracked(session) == given[-1].stop, "all to be tracked")
    check_whole(tmp_path, given[-1].stop - 1)


def test_rubbish_does_not_stop_a_broker_that_sends_one_message_at_a_time(tmp_path: Path) -> None:
    given = batches(20)
    with OneAtATimePeer(tmp_path) as peer:
        peer.settings |= {"client_id": NAME}
        with LiveSession(tmp_path, peer, record={"samples": True}) as session:
            peer.wait_ready()
            for batch in given:
                peer.send(batch)
                peer.send_rubbish()
            until(lambda: tracked(session) == given[-1].stop, "all to be tracked")
    check_whole(tmp_path, given[-1].stop - 1)


def test_a_silent_sender_is_not_taken_for_a_broker_that_waits() -> None:
    flight, now_s, asked = InFlight(), 0.0, 0
    for burst in range(100):  # ten messages of 10 ms each 100 ms, acknowledged every half second
        for number in range(10):
            flight.add(number, burst, now_s, 0.01)
        for _ in range(20):
            now_s += 0.005
            flight.settled(burst - burst % 5 - 1, now_s)
            asked += flight.waits(now_s)
    assert asked < 20  # of 100 bursts

    flight, now_s, sent, asked = InFlight(), 0.0, 0, 0
    while sent < 1000:  # a broker with a backlog that has at most ten messages in flight
        while len(flight) < 10:
            flight.add(sent, sent, now_s, 0.01)
            sent += 1
        now_s += ANSWER_S / 4
        if flight.waits(now_s):
            asked += 1
            flight.settled(sent, now_s)
    assert asked == 100
    assert now_s < 1.0
