"""Who else can read results is said where livebode listens, before and while it does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from livebode.configuration import PublishSection
from livebode.publishing import exposure
from tests.support.command import livebode
from tests.support.receivers import PublishedAxis, configured, free_port

LOGIN = {"username": "reader", "password_env": "SECRET"}


def section(kind: str, url: str, **keys: Any) -> PublishSection:
    return configured({"kind": kind, "url": url} | keys).publish[0]


@pytest.mark.parametrize(
    ("kind", "url", "keys", "says"),
    [
        ("prometheus", "http://127.0.0.1:9464", {}, None),
        ("prometheus", "http://localhost:9464", {}, None),
        ("prometheus", "http://0.0.0.0:9464", {}, "whoever reaches 0.0.0.0:9464 can read the results; restrict it"),
        ("prometheus", "http://[::]:9464", {}, "whoever reaches :::9464 can read"),
        ("opcua", "opc.tcp://[::1]:4840", {}, None),
        ("opcua", "opc.tcp://192.168.1.5", {}, "whoever reaches 192.168.1.5:4840 can read the results; set username"),
        ("opcua", "opc.tcp://0.0.0.0:4840", LOGIN, "the password to 0.0.0.0:4840 is sent unencrypted"),
        ("opcua", "opc.tcp://0.0.0.0:4840", LOGIN | {"certificate_file": "a.pem", "key_file": "b.pem"}, None),
        ("webhook", "http://192.168.1.5/", {}, None),
    ],
)
def test_the_sentence_names_who_can_read_and_what_to_do(
    kind: str, url: str, keys: dict[str, Any], says: str | None
) -> None:
    found = exposure(section(kind, url, **keys))
    assert found == says if says is None else says in str(found)


def test_it_is_said_at_the_start_of_a_run_and_by_the_list_of_receivers(tmp_path: Path) -> None:
    port = free_port()
    own = {"kind": "prometheus", "name": "metrics", "url": f"http://0.0.0.0:{port}"}
    with PublishedAxis(tmp_path, own) as axis:
        assert axis.said == [f"metrics: whoever reaches 0.0.0.0:{port} can read the results; restrict it by a firewall"]
    measured = '[source]\nlog = "log.parquet"\n[signals]\noutput = "y"\n'
    published = f'[[publish]]\nkind = "prometheus"\nurl = "http://0.0.0.0:{port}"\n'
    (tmp_path / "axis.toml").write_text(measured + published)
    listed = livebode("doctor", str(tmp_path / "axis.toml"), "--receivers", "list")
    assert f"whoever reaches 0.0.0.0:{port}" in listed.out
