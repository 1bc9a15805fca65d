"""Receivers of [[publish]] that a test closes, slows down and lets refuse; and an axis that publishes."""

from __future__ import annotations

import json
import threading
from collections.abc import Mapping
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, Self

import livebode
from livebode.configuration import Axis
from livebode.core import Event
from livebode.publishing import Publisher
from livebode.publishing.feed import AxisFeed
from livebode.runtime import ClockSet, FitResults, RunControl, RunStarted
from tests.support.peers.peer import free_port, until

MEASURED = {"source": {"log": "log.parquet"}, "signals": {"output": "y"}}
BEGUN_UNIX_S = 1.8e9


def configured(*sections: Mapping[str, Any], **axis: Any) -> Axis:
    """The smallest axis with these sections."""
    return Axis.of(MEASURED | axis | {"publish": [dict(one) for one in sections]}, "axis.toml")


class HttpReceiver:
    """A server of HTTP whose answer a test chooses; it has what was posted to it.

    Attributes
    ----------
    code
        Its answer; `answers` while it does not answer at all is cleared.
    posted
        Path, headers and body of each request that it answered with 2xx, in their order.
    """

    def __init__(self, port: int = 0, tls: Any = None) -> None:
        self.code, self.posted, self.requests = 200, [], 0
        self.answers = threading.Event()
        self.answers.set()
        outer = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["Content-Length"]))
                outer.requests += 1
                outer.answers.wait()
                if 200 <= outer.code <= 299:
                    outer.posted.append((self.path, dict(self.headers), body))
                self.send_response(outer.code)
                self.send_header("Content-Length", "0")
                self.end_headers()

            def log_message(self, *_: object) -> None:
                pass

        class Server(ThreadingHTTPServer):
            daemon_threads = True
            block_on_close = False

            def handle_error(self, *_: object) -> None:
                pass

        self._server = Server(("127.0.0.1", port), Handler)
        self.port = self._server.server_port
        if tls is not None:
            self._server.socket = tls.wrap_socket(self._server.socket, server_side=True)
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.02,), daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.answers.set()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    @property
    def contents(self) -> list[dict[str, Any]]:
        """The JSON of each request."""
        return [json.loads(body) for _, _, body in self.posted]

    @property
    def texts(self) -> list[str]:
        """The sentence of each event."""
        return [content["text"] for content in self.contents if content["type"] == "event"]


class PublishedAxis:
    """An axis in place of a run: publishes what a test says to the receivers of its sections."""

    def __init__(self, folder: Path, *sections: Mapping[str, Any], name: str = "x", **axis: Any) -> None:
        self.outbox, self.said = folder / "run.outbox.sqlite", []
        self.control = RunControl()
        self.name = name
        self.axes = {name: configured(*sections, **axis)}
        self.publisher = Publisher(self.axes, self.outbox, self.said.append, alone=name)
        self.feed: AxisFeed = self.publisher.subscriber(name)
        self.feed(RunStarted(folder / "run", {}, self.control, None))  # type: ignore[arg-type]
        self.feed(ClockSet(((0.0, BEGUN_UNIX_S),)))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.publisher.close(0.5)

    def change(self, percent: float, number: int = 0) -> None:
        """Report an alarm: the stiffness changed."""
        details = {"what": "stiffness", "amount_percent": percent}
        self.feed(Event("change", number, float(number), f"stiffness {percent} % (no. {number})", details))

    def measure(self) -> None:
        """Publish responses and their fits."""
        responses = livebode.example_responses()[-2:]
        fitter = livebode.Fitter("two-mass")
        self.feed(responses)
        fits = fitter.process(responses)
        self.feed(FitResults((fits, fitter.derived(fits))))

    def reported(self, kind: str) -> list[Event]:
        """The events of this kind that were given to the run since the last call."""
        return [event for event in self.control.take_reported(0, 0.0) if event.kind == kind]

    def counts(self, label: str) -> dict[str, int]:
        """The receiver's entry in run.json."""
        return dict(self.publisher.findings(self.name)["published"][label])


def webhook(port: int, **keys: Any) -> dict[str, Any]:
    """A section of a receiver on the loopback."""
    return {"kind": "webhook", "url": f"http://127.0.0.1:{port}/hook", "name": "hook"} | keys


__all__ = ["HttpReceiver", "PublishedAxis", "free_port", "until", "webhook"]
