"""Events and results at a real broker, as its subscribers get them; the broker is restarted, and refuses a login."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.support.peers.broker import Mosquitto, publisher, stop
from tests.support.peers.peer import program
from tests.support.receivers import PublishedAxis, until


class Subscriber:
    """All topics of a broker: the newest message of each, and all events."""

    def __init__(self, port: int) -> None:
        self.newest: dict[str, Any] = {}
        self.events: list[dict[str, Any]] = []
        self._client = publisher(port)
        self._client.on_message = self._take
        self._client.subscribe("#", qos=1)

    def _take(self, _client: Any, _data: Any, message: Any) -> None:
        text = message.payload.decode()
        content = json.loads(text) if text.startswith("{") else text
        self.newest[message.topic] = content
        if message.topic.endswith("/event"):
            self.events.append(content)

    def __enter__(self) -> Subscriber:
        return self

    def __exit__(self, *_: object) -> None:
        stop(self._client)


def section(broker: Mosquitto, path: str = "", **keys: Any) -> dict[str, Any]:
    return {"kind": "mqtt", "name": "broker", "url": f"mqtt://127.0.0.1:{broker.port}{path}", "interval_s": 0.1} | keys


def test_results_events_and_the_description_for_home_assistant_are_at_the_broker(tmp_path: Path) -> None:
    with Mosquitto(tmp_path) as broker, Subscriber(broker.port) as subscriber:
        sent = section(broker, "/plant/livebode", values=["parameters", "responses", "status"])
        with PublishedAxis(tmp_path, sent, machine={"line": "2", "machine": "press"}) as axis:
            axis.measure()
            axis.change(-2.0, 3)
            until(lambda: subscriber.events, "the event")
            values = until(
                lambda: (of := subscriber.newest.get("plant/livebode/x/values")) and of["alarms"] and of, "results"
            )
            until(lambda: subscriber.newest.get("plant/livebode/state") == "online", "the state")
        until(lambda: subscriber.newest["plant/livebode/state"] == "offline", "the end")
        with Subscriber(broker.port) as later:
            until(lambda: "plant/livebode/x/response" in later.newest, "the retained response")
        assert not later.events
    assert subscriber.events[0]["message"] == "stiffness -2.0 % (no. 3)"
    assert len(subscriber.newest["plant/livebode/x/response"]["frequency_hz"]) == 13
    found = {topic: of for topic, of in subscriber.newest.items() if topic.startswith("homeassistant/")}
    sensor = found["homeassistant/sensor/livebode_2_press_x_Keff/config"]
    assert sensor["state_topic"] == "plant/livebode/x/values"
    assert sensor["unit_of_measurement"] == values["parameters"]["Keff"]["unit"] == "N m/rad"
    assert sensor["value_template"] == "{{ value_json.parameters['Keff'].value }}"
    assert sensor["availability_topic"] == "plant/livebode/state"
    assert found["homeassistant/binary_sensor/livebode_2_press_x_alarm/config"]["device_class"] == "problem"
    assert len({of["unique_id"] for of in found.values()}) == len(found)
    assert len({str(of["device"]["identifiers"]) for of in found.values()}) == 1


def test_without_discovery_home_assistant_hears_nothing(tmp_path: Path) -> None:
    with Mosquitto(tmp_path) as broker, Subscriber(broker.port) as subscriber:
        sent = section(broker, values=["parameters", "responses"], discovery=False)
        with PublishedAxis(tmp_path, sent) as axis:
            axis.measure()
            until(lambda: any(topic.endswith("/x/response") for topic in subscriber.newest), "the results")
    assert not [topic for topic in subscriber.newest if topic.startswith("homeassistant/")]


def test_a_restart_of_the_broker_loses_no_event(tmp_path: Path) -> None:
    with Mosquitto(tmp_path) as broker:
        with PublishedAxis(tmp_path, section(broker, values=[])) as axis:
            axis.change(-2.0, 0)
            until(lambda: axis.counts("broker")["events_delivered"] == 1, "the first event")
            broker.__exit__()
            axis.change(-2.0, 1)
            axis.change(-2.0, 2)
            until(lambda: axis.reported("sink-down"), "the report")
            broker.__enter__()
            with Subscriber(broker.port) as subscriber:
                axis.change(-2.0, 3)
                until(lambda: axis.counts("broker")["events_delivered"] == 4, "all events")
                until(lambda: any(event["sample"] == 3 for event in subscriber.events), "the last one")
        assert not axis.outbox.exists()


@pytest.mark.parametrize("right", [True, False])
def test_a_wrong_password_is_reported_and_a_corrected_file_counts_without_a_restart(
    tmp_path: Path, right: bool
) -> None:
    (tmp_path / "users").write_text("")
    users, secret = tmp_path / "users", tmp_path / "password"
    subprocess.run([program("mosquitto_passwd"), "-b", "-c", users, "axis", "of the broker"], check=True)
    secret.write_text("of the broker" if right else "another")
    with Mosquitto(tmp_path, (f"password_file {users}", "allow_anonymous false")) as broker:
        login = {"username": "axis", "password_file": str(secret), "values": []}
        with PublishedAxis(tmp_path, section(broker, **login)) as axis:
            axis.change(-2.0)
            if not right:
                down = until(lambda: axis.reported("sink-down"), "the report")
                assert "the broker rejects the connection: Not authorized" in down[0].message
                secret.write_text("of the broker")
            until(lambda: axis.counts("broker")["events_delivered"] == 1, "the event")
