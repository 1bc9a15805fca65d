"""[[publish]]: receivers of events and results, their kinds, and the text of a message."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from string import Formatter
from typing import Annotated, Literal
from urllib.parse import urlsplit

from livebode.configuration.section import ConfigurationSection, File
from livebode.core import ConfigError, Field, ValueCheck, nearest_name
from livebode.dataclass import dataclass
from livebode.plugins import named

NAMES = ("axis", "machine", "run", "kind", "priority", "message", "time", "sample", "value", "unit")
"""What a template may contain; the how-to page on connections explains each."""


def check_template(template: str) -> str:
    """The template; ValueError for a name that is not one of `NAMES`, or anything but names between braces.

    >>> check_template("{axis}: {message} ({value} {unit})")
    '{axis}: {message} ({value} {unit})'
    """
    try:
        parts = list(Formatter().parse(template))
    except ValueError as error:
        raise ValueError(f"has braces that do not fit together ({error}); write {{{{ for a brace") from None
    for _, name, form, conversion in parts:
        if name is None:
            continue
        if name not in NAMES:
            raise ValueError(f"has the name {name!r}: {nearest_name(name, NAMES, 'Names')}")
        if form or conversion:
            raise ValueError(f"has a format for {name}, and only {{{name}}} is possible")
    return template


def filled(template: str, values: Mapping[str, str]) -> str:
    """The template with the values of its names.

    >>> filled("{axis}: {message}", {"axis": "x", "message": "{axis} is text here"})
    'x: {axis} is text here'
    """
    return "".join(text + (values[name] if name else "") for text, name, _, _ in Formatter().parse(template))


Part = Literal["parameters", "responses", "status"]
Events = Literal["all", "alarms", "high", "medium", "low", "info"]


@dataclass(frozen=True)
class SinkKind:
    """A kind of receiver.

    Attributes
    ----------
    sink
        "module:name" of the class, a `SinkConnection`; its module imports its library when a sink is created.
    ports
        The schemes of its URL, each with its usual port; None where the URL must name the port.
    keys
        Keys of [[publish]] that it has, in addition to those of every kind.
    events, values
        What it sends by default.
    serves
        Whether it is a server of livebode at that URL, which others read.
    """

    sink: str
    ports: Mapping[str, int | None]
    keys: frozenset[str]
    events: tuple[Events, ...] = ("all",)
    values: tuple[Part, ...] = ("parameters", "status")
    serves: bool = False


_EVERY = {"kind", "name", "url", "timeout_s"}


class PublishSection(ConfigurationSection):
    """[[publish]]: a receiver of events and results. Each section is one receiver.

    Parameters
    ----------
    kind
        Kind of the receiver.
    url
        Address of the receiver: http:// or https:// (webhook, influxdb), smtp:// or smtps:// (email), mqtt:// or
        mqtts:// with the first levels of the topics as its path (mqtt) or group and node (sparkplug), udp://, tcp://
        or tls:// (syslog). Address on which livebode listens: http://127.0.0.1:9464 (prometheus),
        opc.tcp://127.0.0.1:4840 (opcua). Without user and password.
    url_env
        Environment variable with the address, where it is a secret itself (webhook).
    url_file
        File with the address, relative to this file (webhook).
    name
        Name of the receiver in messages and in the record. Default: kind and host.
    events
        Events that are sent: "all", "alarms", "high", "medium" or "low" (alarms of this priority), "info" (what is no
        alarm). Default: all events, for webhook and email the alarms.
    values
        Results that are sent: "parameters" (also margins), "responses", "status". Default: parameters and status, for
        webhook none.
    interval_s
        Shortest time between two messages with results, in seconds.
    template
        Sentence for an event, such as "{axis}: {message}" (webhook, email, syslog). Names: axis, machine, run, kind,
        priority, message, time, sample, value, unit.
    timeout_s
        Longest time for a connection or an answer, in seconds.
    group_s
        After a message, events are collected for this time and sent together, in seconds (email).
    sender
        Address of the sender (email).
    recipients
        Addresses of the recipients (email).
    username
        User name at the server (email, mqtt, sparkplug, opcua).
    password_env
        Environment variable with the password (email, mqtt, sparkplug, opcua).
    password_file
        File with the password, relative to this file (email, mqtt, sparkplug, opcua).
    token_env
        Environment variable with the token for the Authorization header (webhook, influxdb).
    token_file
        File with the token, relative to this file (webhook, influxdb).
    secret_env
        Environment variable with the key of the signature of each message, HMAC-SHA256 (webhook).
    secret_file
        File with the key of the signature, relative to this file (webhook).
    ca_file
        Certificate of the authority that signed the receiver's certificate, relative to this file. Default: the
        authorities of the system.
    certificate_file
        Certificate of livebode, relative to this file (webhook, mqtt, sparkplug, influxdb; prometheus, opcua: of its
        server).
    key_file
        Private key of livebode, relative to this file.
    discovery
        Whether Home Assistant finds the quantities by itself (mqtt).
    """

    kind: str
    url: str | None = None
    url_env: str | None = None
    url_file: File | None = None
    name: Annotated[str, Field(max_length=64)] | None = None
    events: list[Events] | None = None
    values: list[Part] | None = None
    interval_s: Annotated[float, Field(ge=0.1, le=86400)] = 10.0
    template: Annotated[str, ValueCheck(check_template)] | None = None
    timeout_s: Annotated[float, Field(ge=0.1, le=300)] = 10.0
    group_s: Annotated[float, Field(ge=0, le=86400)] = 60.0
    sender: str | None = None
    recipients: list[str] = []
    username: str | None = None
    password_env: str | None = None
    password_file: File | None = None
    token_env: str | None = None
    token_file: File | None = None
    secret_env: str | None = None
    secret_file: File | None = None
    ca_file: File | None = None
    certificate_file: File | None = None
    key_file: File | None = None
    discovery: bool = True

    @property
    def label(self) -> str:
        """Its name in messages and in the record; of a URL only the host, because its path may be a secret."""
        if self.name is not None:
            return self.name
        host = "" if self.url is None else urlsplit(self.url).hostname or ""
        return f"{self.kind} {host}".strip()

    @property
    def sent_events(self) -> tuple[Events, ...]:
        """The events that are sent."""
        return named("sinks")[self.kind].events if self.events is None else tuple(self.events)

    @property
    def sent_values(self) -> tuple[Part, ...]:
        """The results that are sent."""
        return named("sinks")[self.kind].values if self.values is None else tuple(self.values)

    def beside(self, folder: Path) -> PublishSection:
        """With files relative to a folder."""
        files = {name: path for name, path in self if name.endswith("_file") and path is not None}
        return self.model_copy(update={name: folder / path for name, path in files.items()})


def check_publish(sections: list[PublishSection]) -> None:
    """ConfigError for a kind that does not exist, keys that do not fit it, or two receivers of one name."""
    for section in sections:
        _check_keys(section)
        if section.url is not None:
            check_url(section.url, section.kind)
        if section.kind == "email" and not (section.sender and section.recipients):
            raise ConfigError(
                "key-missing",
                "[[publish]] of kind email has no sender or no recipients",
                'add sender = "…" and recipients = ["…"]',
                key="publish.recipients",
            )
        if (section.certificate_file is None) != (section.key_file is None):
            raise ConfigError(
                "incomplete",
                f"[[publish]] {section.label} has one of certificate_file and key_file",
                "add the other one",
                key="publish.key_file",
            )
    labels = [section.label for section in sections]
    if twice := next((label for label in labels if labels.count(label) > 1), None):
        raise ConfigError(
            "key-conflict",
            f"two [[publish]] sections have the name {twice!r}",
            'give each a name of its own: name = "…"',
            key="publish.name",
            value=twice,
        )


def check_url(url: str, kind: str) -> tuple[str, str, int, str]:
    """Scheme, host, port and path with query of a receiver; ConfigError without the URL, of which any part may be
    secret."""
    ports = named("sinks")[kind].ports
    try:
        parts = urlsplit(url)
        port, host = parts.port, parts.hostname
    except ValueError:
        raise _url_error(kind, "is not an address", f"write {next(iter(ports))}://host:port") from None
    if parts.username is not None or "@" in parts.netloc:
        raise ConfigError(
            "secret-in-url",
            f"publish.url of kind {kind} has a user or password",
            "remove it, and use username and password_file, or a token",
            key="publish.url",
        )
    if parts.scheme not in ports:
        allowed = " or ".join(f"{scheme}://" for scheme in ports)
        raise _url_error(kind, "has another scheme than this kind", f"begin it with {allowed}")
    port = port if port is not None else ports[parts.scheme]
    if not host or port is None or not url.isprintable() or " " in url:
        raise _url_error(kind, "is not a complete address", f"write {parts.scheme}://host:port")
    return parts.scheme, host, port, parts.path + (f"?{parts.query}" if parts.query else "")


def _check_keys(section: PublishSection) -> None:
    kind, kinds = section.kind, named("sinks")
    if kind not in kinds:
        raise ConfigError(
            "value-invalid",
            f"publish.kind is {kind!r}, which is not supported",
            f"write one of {', '.join(kinds)}" if kinds else "install the wing connect of livebode",
            key="publish.kind",
            value=kind,
            allowed=list(kinds),
        )
    taken = kinds[kind].keys | _EVERY
    if stray := sorted(section.model_fields_set - taken):
        raise ConfigError(
            "key-unused",
            f"publish.{stray[0]} does not apply to {kind}",
            f"remove it; the keys of {kind} are {', '.join(sorted(taken))}",
            key=f"publish.{stray[0]}",
            allowed=sorted(taken),
        )
    addresses = [key for key in ("url", "url_env", "url_file") if getattr(section, key) is not None]
    if not addresses:
        raise ConfigError("key-missing", f"[[publish]] of kind {kind} has no url", 'add url = "…"', key="publish.url")
    if len(addresses) > 1:
        raise ConfigError(
            "key-conflict",
            f"[[publish]] of kind {kind} has {' and '.join(addresses)}",
            "keep one of them",
            key="publish.url",
        )


def _url_error(kind: str, wrong: str, remedy: str) -> ConfigError:
    return ConfigError("value-invalid", f"publish.url of kind {kind} {wrong}", remedy, key="publish.url")
