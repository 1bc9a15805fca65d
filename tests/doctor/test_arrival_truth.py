"""`livebode doctor` of a live source listens for three seconds and says what came, from whom, and what is wrong."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable, Iterator
from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from livebode.core import Channel
from livebode.sources.live import Batch, encode_layout, encode_samples
from tests.support.command import livebode
from tests.support.foreign import FIELDS, messages, tcp_sender, udp_sender
from tests.support.peers.peer import free_port

SIGNALS = """
[signals]
excitation = "w"
input = "u"
output = "y"
[lines]
frequencies = "50,100,200"
window = 20
[serve]
port = 0
"""


def checked(folder: Path, source: str, signals: str = SIGNALS) -> tuple[int, dict[str, Any]]:
    path = folder / "axis.toml"
    path.write_text(f"[source]\n{source}\n{signals}")
    done = livebode("doctor", "--json", path)
    return done.code, next(check for check in json.loads(done.out)["checks"] if check["name"] == "source")


def frames(rate_hz: float, names: str = "wuy") -> Iterator[bytes]:
    """A layout before each ten samples, of a sender that states this rate."""
    labels = tuple(Channel(name) for name in names)
    for number in range(10_000):
        batch = Batch(10 * number, np.ones((len(labels), 10)), labels, rate_hz)
        yield encode_layout(labels, rate_hz)
        yield encode_samples(batch)


FOREIGN = f"""
[source.fields]
w = "{FIELDS["torque_inject"]}"
u = "{FIELDS["torque_actual"]}"
y = "{FIELDS["vel"]}"
"""


@pytest.mark.parametrize(
    ("payloads", "keys", "verdict", "says"),
    [
        (messages, f"rate_hz = 500\n{FOREIGN}", "warning", "of w, u, y from 127.0.0.1 in 3 s"),
        (messages, f"rate_hz = 500\n{FOREIGN}", "warning", "but the rate is 500 Hz"),
        (lambda: frames(2000.0), "rate_hz = 1000", "failed", "the sender states 2000 Hz instead of 1000 Hz"),
        (lambda: repeat(b"12.5;13.5"), "", "failed", "from 127.0.0.1 within 3 s cannot be used: "),
        (lambda: repeat(b"12.5;13.5"), "", "failed", "the newest has 9 bytes and begins with b'12.5;13.5'"),
        (lambda: frames(1000.0), 'sender = "10.0.0.5"', "failed", "datagrams come from 127.0.0.1, and source.sender"),
        (lambda: frames(1000.0, "wy"), "", "failed", "there is no channel 'u'"),
        (lambda: iter(()), "", "warning", "is free to receive on, but nothing came within 3 s"),
    ],
    ids=["whom", "rate", "stated rate", "garbage", "first bytes", "foreign", "channel", "silent"],
)  # fmt: skip
def test_what_comes_to_a_port_is_judged_by_the_configuration(
    payloads: Callable[[], Iterator[bytes]], keys: str, verdict: str, says: str, tmp_path: Path
) -> None:
    port = free_port()
    with udp_sender(port, payloads()):
        code, check = checked(tmp_path, f'url = "udp://127.0.0.1:{port}"\n{keys}')
    assert (check["verdict"], code) == (verdict, 2 if verdict == "failed" else 0), check
    assert says in check["message"]
    assert check["remedy"]


def test_samples_as_configured_are_counted_and_named(tmp_path: Path) -> None:
    with tcp_sender(messages()) as port:
        code, check = checked(
            tmp_path, f'url = "tcp://127.0.0.1:{port}"\nrate_hz = 1000\nsample_field = "n"\n{FOREIGN}'
        )
    assert (code, check["facts"]["channels"]) == (0, ["w", "u", "y"])
    assert "samples of w, u, y in 3 s" in check["message"]


def test_a_port_that_another_program_has_is_not_listened_to(tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        code, check = checked(tmp_path, f'url = "udp://127.0.0.1:{other.getsockname()[1]}"')
    assert (code, check["verdict"]) == (2, "failed")
    assert "a run of livebode" in check["remedy"]
