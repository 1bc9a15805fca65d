"""No secret in the record, the log, an event or a message."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from livebode.configuration import ConfigurationFile
from livebode.sources.live import encode_layout, encode_samples
from tests.support.command import livebode
from tests.support.peers.broker import Mosquitto, publisher, stop
from tests.support.peers.peer import CHANNELS, RATE_HZ, batches, until
from tests.support.session_process import Running, events
from tests.support.small_axis import ONE_LINE_DIRECT

SECRET = "hunter2-and-more"


@pytest.mark.parametrize(
    "source",
    [
        f'url = "mqtt://me:{SECRET}@127.0.0.1/t"',
        f'url = "mqtt://{SECRET}@127.0.0.1/t"',
        f'url = "tcp://me:{SECRET}@127.0.0.1:1"',
        f'url = "udp://127.0.0.1:1?password={SECRET}"',
        f'url = "http://127.0.0.1:1/{SECRET}@"',
        f'url = "mqtt://h/t"\npassword = "{SECRET}"',
        f'url = "mqtt://h/t"\npassword_env = ["{SECRET}"]',
        f'url = ["mqtt://me:{SECRET}@h/t"]',
        f'url = {{ a = "mqtt://me:{SECRET}@h/t" }}',
    ],
)
def test_a_secret_in_the_configuration_is_refused_and_not_repeated(tmp_path: Path, source: str) -> None:
    (tmp_path / "axis.toml").write_text(f"[source]\n{source}{ONE_LINE_DIRECT}")
    result = livebode("run", tmp_path / "axis.toml", "--out", tmp_path / "run")
    assert result.code == 2
    assert result.err.count("\n") == 1
    assert SECRET not in result.err + result.out
    assert not (tmp_path / "run").exists()


def test_an_edit_that_brings_a_secret_is_not_repeated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PLC_PASSWORD", SECRET)
    with Mosquitto(tmp_path) as broker:
        login = 'username = "plc"\npassword_env = "PLC_PASSWORD"'
        text = f'[source]\nurl = "mqtt://127.0.0.1:{broker.port}/t"\n{login}{ONE_LINE_DIRECT}'
        sender = publisher(broker.port)
        with Running(tmp_path, text, log_level="debug") as running:
            until(lambda: broker.logged("Sending SUBACK"), "a subscription")
            sender.publish("t", encode_layout(CHANNELS, RATE_HZ), qos=1).wait_for_publish(10)
            for batch in batches(60):
                sender.publish("t", encode_samples(batch), qos=1).wait_for_publish(10)
            until(lambda: (running.out / "manifest.jsonl").exists(), "the record")
            running.edit(text.replace("mqtt://", f"mqtt://me:{SECRET}@"))
            for batch in batches(5000, first=batches(60)[-1].stop):
                sender.publish("t", encode_samples(batch), qos=1).wait_for_publish(10)
                if any(event.kind == "configuration-refused" for event in events(running.out)):
                    break
            code, out, err = running.end()
        stop(sender)
    assert code == 0, err
    assert "source.url has a user or password" in err
    for level, logger in (("INFO", "sources.live.mqtt: connected to"), ("WARNING", "runtime.session: ")):
        assert f" {level} livebode.{logger}" in err
    found = b"".join(path.read_bytes() for path in running.out.rglob("*") if path.is_file())
    assert b"configuration-refused" in found
    assert SECRET.encode() not in found
    assert SECRET not in out + err


def test_options_hold_no_secret_either(tmp_path: Path) -> None:
    (tmp_path / "axis.toml").write_text(f'[source]\nurl = "mqtt://h/t"\npassword_file = "p"{ONE_LINE_DIRECT}')
    (tmp_path / "p").write_text(SECRET)
    axis = ConfigurationFile(tmp_path / "axis.toml", {}).read()[""]
    assert SECRET not in repr(axis) + json.dumps(axis.model_dump(mode="json"))
