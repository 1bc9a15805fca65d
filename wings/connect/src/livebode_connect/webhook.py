"""WebhookSink: each event, and each round of results, as a POST of JSON."""

from __future__ import annotations

import hashlib
import hmac
import json
from collections.abc import Sequence
from typing import Any

from livebode.publishing import AxisValues, EventMessage, PublishSection, signing_key
from livebode_connect.http_post import HttpPost

SIGNATURE = "X-Livebode-Signature"
"""Header with ``sha256=`` and the HMAC-SHA256 of the body in hexadecimal digits."""


class WebhookSink:
    """A receiver of HTTP requests: one for each event, so that one that is refused does not refuse others."""

    events_at_once = 1
    pause_s = 0.0

    def __init__(self, section: PublishSection) -> None:
        self._section = section
        signing_key(section)
        self._http = HttpPost(section, "Bearer")

    def send_events(self, events: Sequence[EventMessage]) -> None:
        """Send each event."""
        for event in events:
            text = event.sentence(self._section.template)
            self._post({"type": "event", "text": text} | event.plain(), {"Idempotency-Key": event.id})

    def send_values(self, values: Sequence[AxisValues]) -> None:
        """Send the results of all axes in one request."""
        self._post({"type": "values", "axes": [value.plain() for value in values]}, {})

    def close(self) -> None:
        """Close the connection."""
        self._http.close()

    def _post(self, content: dict[str, Any], headers: dict[str, str]) -> None:
        body = json.dumps(content, ensure_ascii=False, allow_nan=False).encode()
        if (key := signing_key(self._section)) is not None:
            headers = {**headers, SIGNATURE: "sha256=" + hmac.new(key.encode(), body, hashlib.sha256).hexdigest()}
        self._http.post(body, {"Content-Type": "application/json; charset=utf-8", **headers})
