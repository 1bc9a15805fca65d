"""MqttLink: a connection to a broker that is made again when it is needed."""

from __future__ import annotations

import queue
import socket
from collections.abc import Callable, Sequence
from typing import Any

from livebode.core import PublishError, not_installed
from livebode.publishing import PublishSection, address, client_tls, password, unreachable

_KEEPALIVE_S = 30
_LAST_S = 1.0  # for the last message: an ending run does not wait longer for a broker
Message = tuple[str, bytes, bool]
"""Topic, payload, and whether the broker keeps it for new subscribers."""


class MqttLink:
    """A connection of the section; all methods belong to one thread.

    Parameters
    ----------
    section
        With address, login and TLS.
    will
        Called before each connection: the message that the broker publishes if the connection is lost.
    begun
        Called after each connection, with the client of paho.

    Raises
    ------
    ConfigError
        If a secret or certificate cannot be read.
    ExtraError
        If paho-mqtt is not installed.
    """

    def __init__(
        self, section: PublishSection, will: Callable[[], Message], begun: Callable[[Any], None] = lambda _: None
    ) -> None:
        try:
            from paho.mqtt import client
        except ImportError:
            raise not_installed("MQTT needs paho-mqtt, which is not installed", "paho-mqtt", "mqtt") from None
        self._mqtt: Any = client
        self._section, self._will, self._begun = section, will, begun
        self._scheme, self._host, self._port, path = address(section)
        self.path = path.strip("/")
        """Path of the URL: the first levels of the topics."""
        self._client: Any = None
        password(section)
        if self._scheme == "mqtts":
            client_tls(section)

    def publish(self, messages: Sequence[Message], qos: int = 1) -> None:
        """Publish these, and wait until the broker has them; PublishError otherwise."""
        client = self.connected()
        sent = [client.publish(topic, payload, qos=qos, retain=kept) for topic, payload, kept in messages]
        try:
            for message in sent:
                message.wait_for_publish(self._section.timeout_s)
                if not message.is_published():
                    raise TimeoutError
        except (RuntimeError, ValueError, TimeoutError) as error:
            gone = isinstance(error, TimeoutError) and client.is_connected()
            self._drop()
            wrong = error if gone else ConnectionError("the broker closed the connection")
            raise unreachable(wrong, self._section.timeout_s) from None

    def connected(self) -> Any:
        """The client of paho, connected; PublishError if that is not possible."""
        if self._client is not None and self._client.is_connected():
            return self._client
        self._drop()
        client = self._new_client()
        reasons: queue.SimpleQueue[Any] = queue.SimpleQueue()
        client.on_connect = lambda _client, _data, _flags, reason, _properties: reasons.put(reason)
        try:
            client.connect(self._host, self._port, _KEEPALIVE_S)
            client.loop_start()
            self._client = client
            reason = reasons.get(timeout=self._section.timeout_s)
        except (OSError, queue.Empty) as error:
            self._drop()
            wrong = TimeoutError() if isinstance(error, queue.Empty) else error
            raise unreachable(wrong, self._section.timeout_s) from None
        if reason.is_failure:
            self._drop()
            raise PublishError(
                "refused", f"the broker rejects the connection: {reason}", "check publish.username and its password"
            )
        self._begun(client)
        return client

    def close(self, last: Message) -> None:
        """Publish the last message, and disconnect."""
        client, self._client = self._client, None
        if client is None:
            return
        if client.is_connected():
            topic, payload, kept = last
            client.publish(topic, payload, qos=1, retain=kept).wait_for_publish(_LAST_S)
        client.disconnect()
        client.loop_stop()

    def _new_client(self) -> Any:
        section = self._section
        client = self._mqtt.Client(self._mqtt.CallbackAPIVersion.VERSION2, reconnect_on_failure=False)
        client.connect_timeout = section.timeout_s
        client.on_socket_open = lambda _client, _data, link: link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        topic, payload, kept = self._will()
        client.will_set(topic, payload, qos=1, retain=kept)
        secret = password(section)
        if section.username is not None or secret is not None:
            client.username_pw_set(section.username or "", secret)
        if self._scheme == "mqtts":
            client.tls_set_context(client_tls(section))
        return client

    def _drop(self) -> None:
        """End a connection that is of no use."""
        client, self._client = self._client, None
        if client is not None:
            client.disconnect()
            client.loop_stop()
