"""Mails at a real SMTP server: with TLS and login, grouped, refused, and while it is down."""

from __future__ import annotations

import email
import ssl
from email.message import EmailMessage
from pathlib import Path
from typing import Any

import pytest
import trustme
from aiosmtpd.controller import Controller
from aiosmtpd.smtp import AuthResult

from tests.support.certificates import certified
from tests.support.receivers import PublishedAxis, free_port, until


class Mailbox:
    """Receives mails; answers `refusal` instead if that is set."""

    def __init__(self) -> None:
        self.mails: list[EmailMessage] = []
        self.refusal = ""

    async def handle_DATA(self, _server: Any, _session: Any, envelope: Any) -> str:  # noqa: N802 - aiosmtpd's name
        if self.refusal:
            return self.refusal
        self.mails.append(email.message_from_bytes(envelope.content, policy=email.policy.default))
        return "250 OK"


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return certified(tmp_path_factory.mktemp("mail") / "tls", trustme.CA())


def server(mailbox: Mailbox, files: dict[str, Path], port: int, **options: Any) -> Controller:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(files["certificate"], files["key"])
    return Controller(mailbox, hostname="127.0.0.1", port=port, tls_context=context, require_starttls=True, **options)


def section(port: int, files: dict[str, Path], **keys: Any) -> dict[str, Any]:
    of = {"kind": "email", "name": "mail", "url": f"smtp://127.0.0.1:{port}", "sender": "axis@plant.example"}
    return of | {"recipients": ["a@plant.example", "b@plant.example"], "ca_file": str(files["authority"])} | keys


def test_a_hundred_events_are_two_mails(tmp_path: Path, certificates: dict[str, Path]) -> None:
    mailbox, port = Mailbox(), free_port()
    (tmp_path / "password").write_text("of the mail\n")

    def login(_server: Any, _session: Any, _envelope: Any, _mechanism: str, data: Any) -> AuthResult:
        return AuthResult(success=(data.login, data.password) == (b"axis", b"of the mail"))

    keys = {"username": "axis", "password_file": str(tmp_path / "password"), "group_s": 30}
    controller = server(mailbox, certificates, port, authenticator=login, auth_required=True)
    controller.start()
    try:
        with PublishedAxis(tmp_path, section(port, certificates, **keys)) as axis:
            axis.change(-2.0, 0)
            until(lambda: mailbox.mails, "the first alarm, at once")
            for number in range(1, 100):
                axis.change(-2.0, number)
        first, rest = mailbox.mails
    finally:
        controller.stop()
    assert first["Subject"] == "livebode: x: stiffness -2.0 % (no. 0)"
    assert first["To"] == "a@plant.example, b@plant.example"
    assert first.get_content().splitlines() == ["2027-01-15T08:00:00.000Z  x: stiffness -2.0 % (no. 0)"]
    assert rest["Subject"] == "livebode: x: stiffness -2.0 % (no. 1) (and 98 more)"
    lines = rest.get_content().splitlines()
    assert lines[1] == "    … 94 more of this cause …"
    assert [line.rpartition(" ")[2] for line in lines[:1] + lines[2:]] == ["1)", "96)", "97)", "98)", "99)"]


def test_mails_wait_for_the_server_and_one_that_it_refuses_for_ever_is_counted(
    tmp_path: Path, certificates: dict[str, Path]
) -> None:
    mailbox, port = Mailbox(), free_port()
    controller = server(mailbox, certificates, port)
    with PublishedAxis(tmp_path, section(port, certificates, group_s=0)) as axis:
        axis.change(-2.0, 0)
        until(lambda: axis.reported("sink-down"), "the report of a closed port")
        mailbox.refusal = "550 mailbox unavailable"
        controller.start()
        try:
            until(lambda: axis.counts("mail")["events_waiting"] == 1, "a refusal that may pass")
            mailbox.refusal = ""
            until(lambda: len(mailbox.mails) == 1, "the mail")
            mailbox.refusal = "552 too large"
            axis.change(-3.0, 1)
            refused = until(lambda: axis.reported("sink-refused"), "the report")
        finally:
            controller.stop()
        counts = axis.counts("mail")
    assert refused[0].message == "mail refused 1 events permanently: the mail server answers 552 too large"
    assert (counts["events_delivered"], counts["events_refused"]) == (1, 1)


def test_a_password_is_not_sent_without_tls(tmp_path: Path, certificates: dict[str, Path]) -> None:
    mailbox, port = Mailbox(), free_port()
    (tmp_path / "password").write_text("secret")
    controller = Controller(mailbox, hostname="127.0.0.1", port=port)
    controller.start()
    try:
        keys = {"username": "axis", "password_file": str(tmp_path / "password")}
        with PublishedAxis(tmp_path, section(port, certificates, **keys)) as axis:
            axis.change(-2.0)
            down = until(lambda: axis.reported("sink-down"), "the report")
    finally:
        controller.stop()
    assert "the server offers no STARTTLS" in down[0].message
    assert not mailbox.mails
