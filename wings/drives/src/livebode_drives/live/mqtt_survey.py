"""What a broker has: the topics below an address, and the numbers in their messages."""

from __future__ import annotations

import time
from typing import Any

from livebode.core import SourceError, not_installed
from livebode.sources.live import Address, SourceKeys, Survey, parse_address, survey_messages, survey_of
from livebode_drives.live.mqtt import KEEPALIVE_S

_TOPICS_MAX, _MESSAGES_MAX, _TURN_S = 200, 1 << 14, 0.05


def survey(settings: SourceKeys, seconds: float) -> Survey:
    """Listen to the topic of the URL; without one to all topics, with "+" in it to those that it means.

    Raises
    ------
    ExtraError
        If paho-mqtt is not installed.
    SourceError
        If the broker cannot be reached or rejects the connection, or no message arrives.
    """
    address = parse_address(str(settings.url))
    if address.path and "+" not in address.path:
        return survey_messages(settings, seconds)
    try:
        from paho.mqtt import client as mqtt
    except ImportError:
        raise not_installed(
            "mqtt needs the package paho-mqtt, which is not installed", package="paho-mqtt", extra="mqtt"
        ) from None
    topics, refused = _messages(mqtt, address, seconds)
    if refused:
        raise SourceError(
            "refused",
            f"the broker rejected the connection: {refused[0]}",
            "check the address; user and password are keys of [source]",
        ).at(str(address))
    return _survey_of(settings, address.scheme, f"{address.host}:{address.port}", topics, seconds)


def _messages(mqtt: Any, address: Address, seconds: float) -> tuple[dict[str, list[tuple[float, bytes]]], list[str]]:
    """The messages of each topic with the time of their arrival, and why there is no connection."""
    topics: dict[str, list[tuple[float, bytes]]] = {}
    refused: list[str] = []

    def on_connect(client: Any, _data: Any, _flags: Any, reason: Any, _properties: Any) -> None:
        if reason.is_failure:
            refused.append(str(reason))
        client.subscribe(address.path or "#")

    def on_message(_client: Any, _data: Any, message: Any) -> None:
        if message.topic in topics or len(topics) < _TOPICS_MAX:
            kept = topics.setdefault(message.topic, [])
            if len(kept) < _MESSAGES_MAX and not message.retain:
                kept.append((time.monotonic(), message.payload))

    client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, reconnect_on_failure=False)
    client.on_connect, client.on_message = on_connect, on_message
    if address.scheme == "mqtts":
        client.tls_set()
    try:
        client.connect(address.host, address.port, KEEPALIVE_S)
        until = time.monotonic() + seconds
        while time.monotonic() < until and not refused:
            client.loop(_TURN_S)
        client.disconnect()
    except OSError as error:
        refused.append(error.strerror or str(error))
    return topics, refused


def _survey_of(
    settings: SourceKeys, scheme: str, host: str, topics: dict[str, list[tuple[float, bytes]]], seconds: float
) -> Survey:
    """The topic with numbers, if there is one; else the numbers of all topics, with their topics."""
    topics = {topic: messages for topic, messages in topics.items() if messages}
    if not topics:
        raise SourceError(
            "no-samples",
            f"no message arrived on any topic within {seconds:g} s",
            "check that the machine is on and sends",
        ).at(f"{scheme}://{host}")
    if len(topics) == 1:
        url = f"{scheme}://{host}/{next(iter(topics))}"
        return survey_messages(settings.model_copy(update={"url": url}), seconds)
    nothing = SourceError("line-not-json", "the messages are not JSON", "send JSON or frames")
    surveys = {topic: survey_of(f"{scheme}://{host}/{topic}", found, nothing) for topic, found in topics.items()}
    heard = [channel.within(topic) for topic, found in surveys.items() for channel in found.channels]
    most = max(surveys, key=lambda topic: len(topics[topic]))
    words = f"there are {len(topics)} topics; give one of them, such as {scheme}://{host}/{most}"
    return Survey(tuple(heard), {"url": str(settings.url)}, None, words)
