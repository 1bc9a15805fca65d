"""MailSink: events by e-mail, those of a minute in one message."""

from __future__ import annotations

import smtplib
import ssl
from collections.abc import Sequence
from email.message import EmailMessage
from email.utils import formatdate

from livebode.core import PublishError, on_loopback
from livebode.publishing import AxisValues, EventMessage, PublishSection, address, client_tls, password, unreachable

_REPEATED_MAX = 5
_SUBJECT_MAX = 150
_PERMANENT = {552, 554}
"""Answers about the content of the message; other refusals, such as an unknown recipient, can be mended there."""


class MailSink:
    """A mail server (SMTP), always with TLS and a checked certificate: by STARTTLS (smtp) or at once (smtps).

    A server on the loopback without STARTTLS is used without TLS, unless there is a password.
    """

    events_at_once = 500

    def __init__(self, section: PublishSection) -> None:
        self._section = section
        self.pause_s = section.group_s
        address(section), password(section), client_tls(section)

    def send_events(self, events: Sequence[EventMessage]) -> None:
        """Send all of them in one mail."""
        message = EmailMessage()
        message["Subject"] = subject(events)
        message["From"], message["To"] = self._section.sender, ", ".join(self._section.recipients)
        message["Date"] = formatdate(localtime=True)
        message["Message-ID"] = f"<{events[0].id}.{len(events)}@livebode>"
        message.set_content(text(events, self._section.template))
        self._send(message)

    def send_values(self, values: Sequence[AxisValues]) -> None:
        """Nothing: results are not sent by e-mail."""

    def close(self) -> None:
        """Nothing: each mail has a connection of its own."""

    def _send(self, message: EmailMessage) -> None:
        try:
            with self._connection() as server:
                server.send_message(message)
        except smtplib.SMTPResponseException as error:
            raise _refusal(error.smtp_code, error.smtp_error) from None
        except smtplib.SMTPRecipientsRefused as error:
            code, why = next(iter(error.recipients.values()))
            raise _refusal(code, why) from None
        except (OSError, smtplib.SMTPException) as error:
            raise unreachable(error, self._section.timeout_s) from None

    def _connection(self) -> smtplib.SMTP:
        scheme, host, port, _ = address(self._section)
        context, timeout_s = client_tls(self._section), self._section.timeout_s
        if scheme == "smtps":
            server: smtplib.SMTP = smtplib.SMTP_SSL(host, port, timeout=timeout_s, context=context)
        else:
            server = smtplib.SMTP(host, port, timeout=timeout_s)
        try:
            if scheme == "smtp":
                self._start_tls(server, host, context)
            if (secret := password(self._section)) is not None:
                server.login(self._section.username or "", secret)
        except BaseException:
            server.close()
            raise
        return server

    def _start_tls(self, server: smtplib.SMTP, host: str, context: ssl.SSLContext) -> None:
        server.ehlo_or_helo_if_needed()
        if server.has_extn("starttls"):
            server.starttls(context=context)
            server.ehlo()
        elif not on_loopback(host) or password(self._section) is not None:
            raise PublishError(
                "refused", "the server offers no STARTTLS", "use a port with TLS: smtps://host:465, or another server"
            )


def subject(events: Sequence[EventMessage]) -> str:
    """The most important event, and how many others.

    >>> from livebode.publishing import EventMessage
    >>> low = EventMessage("1", "x", "", "r", "gap", "alarm", "medium", "loss", "25 samples are missing", 0.0, 0)
    >>> high = EventMessage("2", "x", "", "r", "change", "alarm", "high", "change", "stiffness is 2 % less", 0.0, 0)
    >>> subject([low, high, low])
    'livebode: x: stiffness is 2 % less (and 2 more)'
    """
    order = ("high", "medium", "low", "info")
    first = min(events, key=lambda event: (event.condition != "alarm", order.index(event.priority)))
    more = f" (and {len(events) - 1} more)" if len(events) > 1 else ""
    sentence = first.sentence(None)
    return f"livebode: {sentence if len(sentence) <= _SUBJECT_MAX else sentence[:_SUBJECT_MAX] + '…'}{more}"


def text(events: Sequence[EventMessage], template: str | None) -> str:
    """The text: one line for each event, by cause; of a cause with many events the first and the newest."""
    causes: dict[tuple[str, str], list[EventMessage]] = {}
    for event in events:
        causes.setdefault((event.axis, event.cause), []).append(event)
    lines = []
    for of_cause in causes.values():
        shown = of_cause if len(of_cause) <= _REPEATED_MAX else [of_cause[0], *of_cause[-_REPEATED_MAX + 1 :]]
        for event in shown:
            lines.append(f"{event.time}  {event.sentence(template)}")
            if event is shown[0] and (omitted := len(of_cause) - len(shown)):
                lines.append(f"    … {omitted} more of this cause …")
    return "\n".join(lines) + "\n"


def _refusal(code: int, answer: bytes | str) -> PublishError:
    words = answer.decode("utf-8", "replace") if isinstance(answer, bytes) else answer
    message = f"the mail server answers {code} {' '.join(words.split())[:120]}"
    if code in _PERMANENT:
        return PublishError("not-taken", message, "check what the mail server permits", status=code)
    remedy = "check publish.username and its password" if code in (530, 534, 535) else "check sender and recipients"
    return PublishError("refused", message, remedy, status=code)
