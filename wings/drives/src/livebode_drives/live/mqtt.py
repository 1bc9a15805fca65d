"""MQTT: frames or NDJSON lines from a broker, acknowledged when they are recorded."""

from __future__ import annotations

import logging
import socket
import ssl
import threading
import time
from base64 import b64decode, b64encode
from collections import deque
from contextlib import suppress
from dataclasses import replace
from math import inf
from typing import Any, ClassVar

from livebode.core import ConfigError, LivebodeError, SourceError, not_installed
from livebode.sources.live import (
    FRAME_BYTES_MAX,
    LAYOUT,
    SPECTRA_LAYOUT,
    TICK_S,
    UNDECIDED_S_MAX,
    Address,
    AnyBatch,
    FieldDecoder,
    FrameDecoder,
    LiveSource,
    Position,
    encode_line,
    existing,
    message_decoder,
    password,
    read_header,
)
from livebode_drives.source_settings import DriveKeys

RECEIVE_MAX = 4096
"""Messages that a broker may send without an acknowledgement: several times those of the interval of commits."""
ANSWER_S = 0.02
"""A broker that waited for acknowledgements sends the next message within this time after them."""
OVERDUE_S = 0.01
"""A message may be later by this than twice the time of its samples, before the broker seems to wait."""
PATIENCE_S_MAX = 0.5


class InFlight:
    """Messages of one connection in their order, each with the delivery that settles it.

    Many brokers send 10 to 32 messages, whatever a client asks for, and then wait for acknowledgements. That shows as
    a next message that is overdue, and comes as soon as others are acknowledged: their number is remembered.
    """

    def __init__(self) -> None:
        self._messages: deque[tuple[int, int]] = deque()
        self._arrived_s = self._patience_s = 0.0
        self._usual_s = 0.0
        self._most: float = inf  # that the broker sends
        self._asked: tuple[int, float] | None = None  # how many there were, and when the first was acknowledged

    def __len__(self) -> int:
        return len(self._messages)

    def add(self, number: int, delivery: int, now_s: float, seconds: float) -> None:
        """A message arrived, with samples of so many seconds."""
        if self._asked is not None:
            count, acknowledged_s = self._asked
            if 0 <= now_s - acknowledged_s <= ANSWER_S:
                self._most, self._patience_s, self._asked = count, 0.0, None
            else:
                self._did_not_wait()
        self._messages.append((number, delivery))
        self._arrived_s, self._usual_s = now_s, seconds

    def silent_s(self, now_s: float) -> float:
        """Seconds since the newest message."""
        return now_s - self._arrived_s

    def settled(self, delivery: int, now_s: float) -> list[int]:
        """Messages to acknowledge, since the deliveries up to this one are settled."""
        batches = []
        while self._messages and self._messages[0][1] <= delivery:
            batches.append(self._messages.popleft()[0])
        if batches and self._asked is not None and self._asked[1] == inf:
            self._asked = self._asked[0], now_s
        return batches

    def waits(self, now_s: float) -> bool:
        """Whether the broker seems to wait for acknowledgements."""
        if self._asked is not None:
            if now_s - self._asked[1] <= ANSWER_S:
                return False
            self._did_not_wait()
        overdue_s = self._arrived_s + 2 * self._usual_s + OVERDUE_S + self._patience_s
        if self._messages and (len(self._messages) >= self._most or now_s > overdue_s):
            self._asked = len(self._messages), inf
            return True
        return False

    def _did_not_wait(self) -> None:
        """The sender is silent, or sends many at once."""
        self._most, self._asked = inf, None
        self._patience_s = min(PATIENCE_S_MAX, 2 * self._patience_s + OVERDUE_S)


KEEPALIVE_S = 15
QUEUE_S_MAX = 12.0
"""Longest machine time that waits to be tracked; the rest is at the broker. It is less than what stops monitoring."""
SOON_S = 0.005
"""Interval in which it is looked at what is recorded."""
SESSION_S = 3600
"""How long a broker stores messages while a client with a `client_id` is disconnected."""
PACKET_BYTES_MAX = 8 * FRAME_BYTES_MAX
_TOPIC_BYTES_MAX = 65535
_VERSION_UNSUPPORTED = 0x84
_REFUSALS = {0x85, 0x86, 0x87, 0x8A, 0x8C, 0x9D}
_UNANSWERED_MAX = 3


class MqttSource(LiveSource):
    """Subscribes to one topic with QoS 1; each message is a frame, or an object of JSON.

    By MQTT 5, or 3.1.1 where the broker supports only that. A message is acknowledged when its samples are recorded. A
    message with QoS 0 has no acknowledgement, and the broker does not wait.
    """

    settings: DriveKeys
    format: ClassVar[str] = "mqtt"
    reorders: ClassVar[bool] = True
    waits: ClassVar[bool] = True
    queue_s_max: ClassVar[float] = QUEUE_S_MAX

    def __init__(self, settings: DriveKeys, address: Address) -> None:
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
        self._password = password(settings.password_env, settings.password_file)
        self._tls = tls_context(settings) if address.scheme == "mqtts" else None
        self._frames, self._lines = FrameDecoder(), message_decoder(settings)
        self._unanswered = 0
        self._older, self._unsupported = False, False
        self._refusal: SourceError | None = None
        self._answered = False
        self._in_flight, self._deliveries, self._left = InFlight(), 0, threading.Event()
        self._announcement = b""  # a message that announces the channels, without which later ones cannot be decoded
        self._announced: object = None

    def resume(self, position: Position) -> None:
        super().resume(position)
        with suppress(LivebodeError):  # there may be none
            self._decode(b64decode((position.mark or {}).get("announcement", "")))

    def close(self) -> None:
        self._left.set()
        super().close()

    def _receive(self) -> bool:
        client = self._client()
        self._answered, unsupported = False, self._unsupported
        if isinstance(self._lines, FieldDecoder):
            self._lines = message_decoder(self.settings)
        self._in_flight = InFlight()  # the broker sends again what was not acknowledged, with other numbers
        try:
            self._connect(client)
            while not self._stop.is_set():
                code = self._turn(client)
                if self._refusal is not None:
                    raise self._refusal
                if self._unsupported and not unsupported:
                    return False  # and connect by the older version
                if code:
                    self._gone(code)
            self._inbox.close()  # what it holds is recorded, and then acknowledged
            while self._in_flight and not self._left.is_set() and not self._turn(client):
                pass
            client.disconnect()
        finally:
            client.on_disconnect = None
            client._sock_close()
        return False

    def _turn(self, client: Any) -> int:
        """Receive, and acknowledge what is settled; an error of the connection, or 0."""
        code = client.loop(timeout=SOON_S if self._in_flight else TICK_S)
        now_s, delivery = time.monotonic(), self._settled.delivery
        if delivery == self._deliveries and self._in_flight.silent_s(now_s) > UNDECIDED_S_MAX:
            delivery += 1  # an announcement, without which nothing follows
        for number in self._in_flight.settled(delivery, now_s):
            code = code or client.ack(number, 1)
        if self._in_flight.waits(now_s):
            self.asks_commit = True
            self._inbox.listener()
        return int(code)

    def _client(self) -> Any:
        mqtt, settings = self._mqtt, self.settings
        client = mqtt.Client(
            mqtt.CallbackAPIVersion.VERSION2,
            client_id=settings.client_id or "",
            protocol=mqtt.MQTTv311 if self._older else mqtt.MQTTv5,
            clean_session=not settings.client_id if self._older else None,
            reconnect_on_failure=False,
            manual_ack=True,
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
        if self._stop.is_set():
            return  # the broker sends it again
        stored = message.qos > 0
        batch, seconds, settles = None, 0.0, self._deliveries
        try:
            batch = self._decode(message.payload)
        except LivebodeError as error:
            self._malformed(error, message.payload)
        if batch is not None or self._announcement is message.payload:
            settles += 1  # an announcement is stored until the next samples are recorded
        if batch is not None:
            self._deliveries = settles
            mark = {"announcement": b64encode(self._announcement).decode()}
            batch = replace(batch, mark=mark, delivery=settles, again=message.dup)
            seconds = batch.samples / batch.rate_hz
            self._deliver(batch, waits=stored)
        if stored:
            self._in_flight.add(message.mid, settles, time.monotonic(), seconds)

    def _decode(self, payload: bytes) -> AnyBatch | None:
        """The batch in a message; remembers how a later one can be decoded."""
        if isinstance(self._lines, FieldDecoder):
            return self._lines.decode(payload)
        if payload[:1] != b"{":
            batch = self._frames.decode(payload)
            header = read_header(payload)
            announced: object = header.kind, header.layout
            if header.kind in (LAYOUT, SPECTRA_LAYOUT) and announced != self._announced:
                self._announcement, self._announced = payload, announced
            return batch
        line = self._lines.decode(payload)
        announced = line.channels, line.rate_hz, line.epoch
        if announced != self._announced:
            self._announcement, self._announced = encode_line(replace(line, data=line.data[:, :1])), announced
        return line


def _session(*, kept: bool) -> dict[str, Any]:
    """Arguments of a connection by MQTT 5: largest message, messages in flight, how long the broker stores others."""
    from paho.mqtt.packettypes import PacketTypes
    from paho.mqtt.properties import Properties

    properties: Any = Properties(PacketTypes.CONNECT)  # type: ignore[no-untyped-call]
    properties.MaximumPacketSize = PACKET_BYTES_MAX
    properties.ReceiveMaximum = RECEIVE_MAX
    if kept:
        properties.SessionExpiryInterval = SESSION_S
    return {"clean_start": not kept, "properties": properties}


def tls_context(settings: DriveKeys) -> ssl.SSLContext:
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
