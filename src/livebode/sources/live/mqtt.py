"""MQTT: frames or NDJSON lines from a broker."""

from __future__ import annotations

import logging
import socket
import ssl
from typing import Any, ClassVar

from livebode.core import ConfigError, LivebodeError, SourceError
from livebode.core.installing import not_installed
from livebode.sources.live.address import Address
from livebode.sources.live.frame import FrameDecoder
from livebode.sources.live.framing import FRAME_BYTES_MAX
from livebode.sources.live.ndjson import LineDecoder
from livebode.sources.live.secret import existing, password
from livebode.sources.live.settings import SourceSettings
from livebode.sources.live.source import TICK_S, LiveSource

KEEPALIVE_S = 15
SESSION_S = 3600
"""How long a broker stores messages while a client with a `client_id` is disconnected."""
PACKET_BYTES_MAX = 8 * FRAME_BYTES_MAX
_TOPIC_BYTES_MAX = 65535
_VERSION_UNSUPPORTED = 0x84
_REFUSALS = {0x85, 0x86, 0x87, 0x8A, 0x8C, 0x9D}
_UNANSWERED_MAX = 3


class MqttSource(LiveSource):
    """Subscribes to one topic with QoS 1; each message is a frame, or an object of JSON.

    By MQTT 5, or 3.1.1 where the broker supports only that.
    """

    format: ClassVar[str] = "mqtt"
    reorders: ClassVar[bool] = True

    def __init__(self, settings: SourceSettings, address: Address) -> None:
        super().__init__(settings, address)
        try:
            from paho.mqtt import client as mqtt
        except ImportError:
            raise not_installed(
                "mqtt needs the package paho-mqtt, which is not installed", package="paho-mqtt", extra="mqtt"
            ) from None
        self._mqtt = mqtt
        topic = address.path
        if not topic or "+" in topic or "#" in topic or len(topic.encode()) > _TOPIC_BYTES_MAX:
            raise ConfigError(
                "value-invalid",
                f"the topic {topic[:40]!r} in source.url is empty, too long or has a wildcard",
                "give mqtt://broker/one/topic",
                key="source.url",
                value=topic[:40],
            )
        self._password = password(settings)
        self._tls = tls_context(settings) if address.scheme == "mqtts" else None
        self._frames, self._lines = FrameDecoder(), LineDecoder(settings.rate_hz)
        self._unanswered = 0
        self._older, self._unsupported = False, False
        self._refusal: SourceError | None = None
        self._answered = False

    def _receive(self) -> bool:
        client = self._client()
        self._answered, unsupported = False, self._unsupported
        try:
            self._connect(client)
            while not self._stop.is_set():
                code = client.loop(timeout=TICK_S)
                if self._refusal is not None:
                    raise self._refusal
                if self._unsupported and not unsupported:
                    return False  # and connect by the older version
                if code:
                    self._gone(code)
            client.disconnect()
        finally:
            client.on_disconnect = None
            client._sock_close()
        return False

    def _client(self) -> Any:
        mqtt, settings = self._mqtt, self.settings
        client = mqtt.Client(
            mqtt.CallbackAPIVersion.VERSION2,
            client_id=settings.client_id or "",
            protocol=mqtt.MQTTv311 if self._older else mqtt.MQTTv5,
            clean_session=not settings.client_id if self._older else None,
            reconnect_on_failure=False,
        )
        client.on_connect, client.on_subscribe, client.on_message = (
            self._on_connect,
            self._on_subscribe,
            self._on_message,
        )
        client.on_socket_open = no_delay
        if settings.username is not None or self._password is not None:
            client.username_pw_set(settings.username or "", self._password)
        if self._tls is not None:
            client.tls_set_context(self._tls)
        return client

    def _connect(self, client: Any) -> None:
        session = {} if self._older else _session(kept=bool(self.settings.client_id))
        try:
            client.connect(self.address.host, self.address.port, KEEPALIVE_S, **session)
        except ssl.SSLError as error:
            close_left(error)
            raise SourceError(
                "refused",
                f"TLS with the broker failed: {getattr(error, 'verify_message', '') or error.reason}",
                "check source.ca_file and the broker's certificate",
            ) from None

    def _gone(self, code: int) -> None:
        if self._unsupported and not self._answered and code == self._mqtt.MQTT_ERR_PROTOCOL:
            raise SourceError(
                "refused", "the broker supports neither MQTT 5 nor MQTT 3.1.1", "check the address and its listener"
            )
        if not self._unsupported:
            # Some brokers close the connection without an answer at a version that they do not support.
            self._older = not self._answered and not self._older
        if not self._answered:
            self._unanswered += 1
            if self._tls is not None and self._unanswered >= _UNANSWERED_MAX:
                raise SourceError(
                    "refused",
                    "the broker closes the connection before it answers",
                    "if it requires a certificate, check source.certificate_file and source.key_file",
                )
        raise ConnectionError(self._mqtt.error_string(code).rstrip("."))

    def _on_connect(self, client: Any, _data: Any, _flags: Any, reason: Any, _properties: Any) -> None:
        self._answered, self._unanswered = True, 0
        if reason.value == _VERSION_UNSUPPORTED and not self._unsupported:
            self._older, self._unsupported = not self._older, True
            self._log(logging.INFO, "the broker does not support MQTT 5; using MQTT 3.1.1")
        elif reason.value in {_VERSION_UNSUPPORTED, *_REFUSALS}:
            self._refusal = SourceError(
                "refused", f"the broker rejected the connection: {reason}", "check source.username and its password"
            )
        elif not reason.is_failure:
            client.subscribe(self.address.path, qos=1)

    def _on_subscribe(self, _client: Any, _data: Any, _number: int, reasons: list[Any], _properties: Any) -> None:
        if any(reason.is_failure for reason in reasons):
            self._refusal = SourceError(
                "refused",
                f"the broker denies the subscription to {self.address.path}: {reasons[0]}",
                "check the topic and the broker's access rights",
                topic=self.address.path,
            )
        else:
            self._established()

    def _on_message(self, _client: Any, _data: Any, message: Any) -> None:
        payload = message.payload
        try:
            batch = self._lines.decode(payload) if payload[:1] == b"{" else self._frames.decode(payload)
        except LivebodeError as error:
            self._malformed(error)
            return
        if batch is not None:
            self._deliver(batch)


def _session(*, kept: bool) -> dict[str, Any]:
    """Arguments of a connection by MQTT 5: the largest message, and how long the broker stores messages."""
    from paho.mqtt.packettypes import PacketTypes
    from paho.mqtt.properties import Properties

    properties: Any = Properties(PacketTypes.CONNECT)  # type: ignore[no-untyped-call]
    properties.MaximumPacketSize = PACKET_BYTES_MAX
    if kept:
        properties.SessionExpiryInterval = SESSION_S
    return {"clean_start": not kept, "properties": properties}


def tls_context(settings: SourceSettings) -> ssl.SSLContext:
    """TLS context: the trusted authority, and our own certificate if there is one."""
    authority = None if settings.ca_file is None else existing(settings.ca_file, "ca_file")
    try:
        context = ssl.create_default_context(cafile=authority)
        if settings.certificate_file is not None:
            key = None if settings.key_file is None else existing(settings.key_file, "key_file")
            context.load_cert_chain(existing(settings.certificate_file, "certificate_file"), key)
    except ssl.SSLError as error:
        raise ConfigError(
            "file-unusable",
            f"a certificate or key of [source] cannot be used: {error.reason or error}",
            "check source.ca_file, source.certificate_file and source.key_file",
            key="source",
        ) from None
    return context


def close_left(error: ssl.SSLError) -> None:
    """Close the socket that paho leaves open after a failed handshake; only the error refers to it."""
    trace = error.__traceback__
    while trace is not None:
        for left in trace.tb_frame.f_locals.values():
            if isinstance(left, ssl.SSLSocket):
                left.close()
        trace = trace.tb_next


def no_delay(_client: Any, _data: Any, link: socket.socket) -> None:
    link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)


SOURCE = MqttSource
