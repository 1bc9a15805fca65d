"""What a webhook posts: the event in words and as data, over TLS, with token and signature."""

from __future__ import annotations

import hashlib
import hmac
import ssl
from pathlib import Path

import pytest
import trustme

from livebode.core import Event
from tests.support.certificates import certified
from tests.support.receivers import HttpReceiver, PublishedAxis, until, webhook


def test_a_post_has_sentence_data_token_and_signature_over_tls(tmp_path: Path) -> None:
    files = certified(tmp_path / "tls", trustme.CA())
    tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    tls.load_cert_chain(files["certificate"], files["key"])
    (tmp_path / "token").write_text("abc\n")
    (tmp_path / "key").write_text("key of both\n")
    with HttpReceiver(tls=tls) as receiver:
        section = webhook(
            receiver.port,
            url=f"https://127.0.0.1:{receiver.port}/hook?channel=1",
            template="{axis}|{machine}|{kind}|{priority}|{message}|{time}|{value} {unit}",
            token_file=str(tmp_path / "token"),
            secret_file=str(tmp_path / "key"),
            ca_file=str(files["authority"]),
        )
        with PublishedAxis(tmp_path, section, machine={"line": "2", "machine": "press"}) as axis:
            axis.change(-2.5, 10)
            until(lambda: receiver.posted, "the event")
    path, headers, body = receiver.posted[0]
    (content,) = receiver.contents
    assert path == "/hook?channel=1"
    assert headers["Authorization"] == "Bearer abc"
    assert headers["X-Livebode-Signature"] == "sha256=" + hmac.new(b"key of both", body, hashlib.sha256).hexdigest()
    assert headers["Idempotency-Key"] == content["id"]
    sentence = "stiffness -2.5 % (no. 10)"
    assert content["text"] == f"x|2/press|change|high|{sentence}|2027-01-15T08:00:10.000Z|-2.5 %"
    assert content["condition"] == "alarm"
    assert content["cause"] == "change: stiffness"
    assert (content["value"], content["unit"], content["unix_s"]) == (-2.5, "%", 1.8e9 + 10)


def test_address_and_key_may_be_in_the_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with HttpReceiver() as receiver:
        monkeypatch.setenv("HOOK", f"http://127.0.0.1:{receiver.port}/secret")
        monkeypatch.setenv("HOOK_KEY", "key of both")
        section = {"kind": "webhook", "name": "hook", "url_env": "HOOK", "secret_env": "HOOK_KEY"}
        with PublishedAxis(tmp_path, section) as axis:
            axis.change(-2.5, 10)
            until(lambda: receiver.posted, "the event")
    path, headers, body = receiver.posted[0]
    assert path == "/secret"
    assert headers["X-Livebode-Signature"] == "sha256=" + hmac.new(b"key of both", body, hashlib.sha256).hexdigest()


def test_an_unknown_certificate_is_refused(tmp_path: Path) -> None:
    files = certified(tmp_path / "tls", trustme.CA())
    tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    tls.load_cert_chain(files["certificate"], files["key"])
    with HttpReceiver(tls=tls) as receiver:
        section = webhook(receiver.port, url=f"https://127.0.0.1:{receiver.port}/")
        with PublishedAxis(tmp_path, section) as axis:
            axis.change(1.0)
            down = until(lambda: axis.reported("sink-down"), "the report")
        assert "TLS failed: " in down[0].message
        assert not receiver.posted


def test_alarms_are_sent_with_their_ends_and_other_events_only_on_request(tmp_path: Path) -> None:
    with HttpReceiver() as receiver, HttpReceiver() as all_of_them:
        sections = webhook(receiver.port), webhook(all_of_them.port, name="all", events=["all"])
        with PublishedAxis(tmp_path, *sections) as axis:
            axis.feed(Event("connected", 0, 0.0, "the first connection ends no alarm"))
            axis.change(-3.0, 1)
            axis.feed(Event("fit-failed", 2, 2.0, "no fit"))
            axis.feed(Event("change-cleared", 3, 3.0, "as before", {"what": "stiffness"}))
            axis.feed(Event("gap", 4, 4.0, "25 samples are missing", {"missing": 25}))
            until(lambda: len(all_of_them.posted) == 5, "all events")
            until(lambda: len(receiver.posted) == 3, "the alarms")
    found = [(one["kind"], one["condition"], one["priority"]) for one in receiver.contents]
    assert found == [("change", "alarm", "high"), ("change-cleared", "ended", "high"), ("gap", "alarm", "medium")]
    assert receiver.contents[2]["unit"] == "samples"
    assert [one["priority"] for one in all_of_them.contents] == ["info", "high", "info", "high", "medium"]
