"""Syslog messages by UDP, TCP and TLS, as an independent reader of RFC 5424 takes them apart."""

from __future__ import annotations

import re
import socket
import ssl
import threading
from pathlib import Path
from typing import Any

import pytest
import trustme
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.publishing import EventMessage
from livebode_connect.syslog import rfc5424
from tests.support.certificates import certified
from tests.support.peers.peer import PATIENCE_S
from tests.support.receivers import PublishedAxis, free_port, until

_MESSAGE = re.compile(
    rb"<(\d{1,3})>1 (\S+) (\S{1,255}) (\S{1,48}) (\S{1,128}) (\S{1,32}) "
    rb'\[([^ =\]"]{1,32})((?: [^ =\]"]{1,32}="(?:[^"\\\]]|\\["\\\]])*")*)\] \xef\xbb\xbf(.*)',
    re.DOTALL,
)
_PAIR = re.compile(r' ([^ =]+)="((?:[^"\\\]]|\\["\\\]])*)"')


def read(message: bytes) -> tuple[int, str, dict[str, str], str]:
    """Priority, message id, parameters and text of a message; it must match the grammar."""
    found = _MESSAGE.fullmatch(message)
    assert found is not None, message
    pairs = {name: re.sub(r'\\(["\\\]])', r"\1", value) for name, value in _PAIR.findall(found[8].decode())}
    return int(found[1]), found[6].decode(), pairs, found[9].decode()


@settings(max_examples=40)
@given(st.text(max_size=30), st.text(max_size=30))
def test_any_text_survives_the_grammar(cause: str, message: str) -> None:
    cause, message = (text.encode("utf-8", "ignore").decode() for text in (cause, message))
    event = EventMessage("ab", "x", "", "r", "gap", "alarm", "medium", cause, message, 1.8e9, 7)
    priority, kind, pairs, text = read(rfc5424(event, "host ä", None))
    assert (priority, kind, pairs["cause"], pairs["sample"]) == (28, "gap", cause, "7")
    assert text == " ".join(f"x: {message}".splitlines())


def test_udp(tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as server:
        server.bind(("127.0.0.1", 0))
        server.settimeout(20)
        section = {"kind": "syslog", "url": f"udp://127.0.0.1:{server.getsockname()[1]}", "template": "{message}!"}
        with PublishedAxis(tmp_path, section) as axis:
            axis.change(-2.0, 3)
            priority, kind, pairs, text = read(server.recv(4096))
    assert (priority, kind, text) == (3 * 8 + 2, "change", "stiffness -2.0 % (no. 3)!")
    assert pairs["condition"] == "alarm"


def frames(link: Any) -> bytes:
    """The next message with its length in front (RFC 6587, RFC 5425)."""
    length = b""
    while (letter := link.recv(1)) != b" ":
        if not letter:
            return b""
        length += letter
    message = b""
    while len(message) < int(length):
        message += link.recv(int(length) - len(message))
    return message


@pytest.mark.parametrize("scheme", ["tcp", "tls"])
def test_by_a_connection_that_breaks_every_event_arrives(tmp_path: Path, scheme: str) -> None:
    files, port = certified(tmp_path / "tls", trustme.CA()), free_port()
    tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    tls.load_cert_chain(files["certificate"], files["key"])
    found: list[bytes] = []

    def serve(messages: int) -> None:
        with socket.create_server(("127.0.0.1", port)) as server:
            link, _ = server.accept()
            with tls.wrap_socket(link, server_side=True) if scheme == "tls" else link as link:
                found.extend(frames(link) for _ in range(messages))

    section = {"kind": "syslog", "name": "log", "url": f"{scheme}://127.0.0.1:{port}"}
    section |= {"ca_file": str(files["authority"])}
    with PublishedAxis(tmp_path, section) as axis:
        axis.change(-2.0, 0)
        until(lambda: axis.reported("sink-down"), "the report of a closed port")
        for first in (0, 2):
            thread = threading.Thread(target=serve, args=(2,))
            thread.start()
            if first:
                axis.change(-2.0, first)
            axis.change(-2.0, first + 1)
            thread.join(PATIENCE_S)
    assert [read(message)[2]["sample"] for message in found] == ["0", "1", "2", "3"]
