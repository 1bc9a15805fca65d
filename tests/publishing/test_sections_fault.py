"""What is wrong in [[publish]] is refused with its reason when the configuration is read, and no secret is shown."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from livebode.core import ConfigError
from livebode.publishing import open_sink, sections_of
from tests.support.command import livebode
from tests.support.errors import refused
from tests.support.receivers import HttpReceiver, configured

SECRET = "s3cret-of-the-plant"


HOOK = {"kind": "webhook", "url": "https://hooks.example.com/a/b"}


@pytest.mark.parametrize(
    ("section", "code", "words"),
    [
        (HOOK | {"template": "{axis} {mesage}"}, "value-invalid", "has the name 'mesage': did you mean 'message'?"),
        (HOOK | {"template": "{axis.__class__}"}, "value-invalid", "has the name"),
        (HOOK | {"template": "{message!r}"}, "value-invalid", "only {message} is possible"),
        (HOOK | {"template": "{axis"}, "value-invalid", "braces"),
        (HOOK | {"recipients": ["a@b"]}, "key-unused", "publish.recipients does not apply to webhook"),
        (HOOK | {"evnts": ["all"]}, "key-unknown", "did you mean 'events'?"),
        (HOOK | {"events": ["hihg"]}, "value-invalid", "publish.0.events.0"),
        (HOOK | {"url_file": "x"}, "key-conflict", "url and url_file"),
        ({"kind": "webhook"}, "key-missing", "no url"),
        ({"kind": "email", "url": "smtp://mail"}, "key-missing", "no sender or no recipients"),
        (HOOK | {"key_file": "k.pem"}, "incomplete", "one of certificate_file and key_file"),
        (HOOK | {"url": f"https://me:{SECRET}@hooks.example.com/"}, "secret-in-url", "user or password"),
        (HOOK | {"url": f"ftp://{SECRET}"}, "value-invalid", "begin it with http:// or https://"),
        (HOOK | {"url": f"https://[{SECRET}"}, "value-invalid", "is not an address"),
        (HOOK | {"url": 7}, "value-invalid", "publish.0.url = its value"),
        (HOOK | {"password_file": "p"}, "key-unused", "publish.password_file does not apply"),
    ],
)
def test_a_section_that_cannot_be_used_is_refused(section: dict[str, Any], code: str, words: str) -> None:
    with pytest.raises(ConfigError) as caught:
        configured(section)
    assert caught.value.code == f"config.{code}"
    assert words in str(caught.value)
    assert SECRET not in f"{caught.value} {caught.value.facts}"


def test_two_receivers_have_two_names() -> None:
    with refused(ConfigError, "key-conflict", value="webhook hooks.example.com"):
        configured(HOOK, HOOK | {"events": ["all"]})
    assert configured(HOOK, HOOK | {"name": "second"}).publish[1].label == "second"
    with refused(ConfigError, "key-conflict"):
        sections_of({"a": configured(HOOK), "b": configured(HOOK | {"events": ["high"]})})
    assert len(sections_of({"a": configured(HOOK), "b": configured(HOOK)})) == 1  # one receiver serves both


def test_secrets_come_from_a_file_or_the_environment_and_their_absence_names_the_key_only(tmp_path: Path) -> None:
    (section,) = configured(HOOK | {"token_env": SECRET}).publish
    with refused(ConfigError, "secret-missing", key="publish.token_env"):
        open_sink(section)
    (section,) = configured(HOOK | {"secret_file": "absent"}).beside(tmp_path).publish
    with refused(ConfigError, "file-unreadable", key="publish.secret_file"):
        open_sink(section)


def test_the_command_lists_and_tests_each_section_in_one_line(tmp_path: Path) -> None:
    file = tmp_path / "axis.toml"
    with HttpReceiver() as receiver:
        (tmp_path / "url").write_text(f"http://127.0.0.1:{receiver.port}/services/{SECRET}\n")
        file.write_text(
            '[source]\nlog = "a.csv"\n[signals]\noutput = "y"\n'
            '[[publish]]\nname = "chat"\nkind = "webhook"\nurl_file = "url"\n'
            f'[[publish]]\nname = "absent"\nkind = "webhook"\nurl = "http://127.0.0.1:9/{SECRET}"\n'
        )
        listed, tested = (
            livebode("doctor", file, "--receivers", "list"),
            livebode("doctor", file, "--receivers", "test"),
        )
        as_json = livebode("doctor", file, "--receivers", "test", "--json")
    assert listed.out == "chat: events (alarms)\nabsent: events (alarms)\n"
    assert listed.code == 0
    chat, absent = tested.out.splitlines()
    assert chat.startswith("chat: delivered in ")
    assert absent.startswith("absent: not delivered: no connection: Connection refused; check that")
    assert tested.code == as_json.code == 2
    assert receiver.texts[0] == "test: This is a test message of livebode; nothing has happened."
    assert receiver.posted[0][0] == f"/services/{SECRET}"
    assert SECRET not in listed.out + tested.out + tested.err + as_json.out + as_json.err
    file.write_text('[source]\nlog = "a.csv"\n[signals]\noutput = "y"\n')
    assert "has no [[publish]] section" in livebode("doctor", file, "--receivers", "list").err
