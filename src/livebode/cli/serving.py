"""The dashboard of a command."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from livebode.configuration import ServeSection
from livebode.core import calls_at_end
from livebode.runtime import Subscriber

if TYPE_CHECKING:
    from livebode.dashboard import Dashboard

SubscribersOf = Callable[[str], tuple[Subscriber, ...]]


def print_line(sentence: str) -> None:
    """Print a message on standard error."""
    print(f"livebode: {sentence}", file=sys.stderr, flush=True)


def dashboard_of(section: ServeSection, port: int | None) -> Dashboard:
    """The dashboard of a configuration; `port` overrides its port."""
    from livebode.dashboard import Dashboard, ServerSettings

    if port is not None:
        section = section.model_copy(update={"port": port})
    return Dashboard(ServerSettings.of(section), print_line)


@contextmanager
def served(
    section: ServeSection, port: int | None, entries: Mapping[str, Sequence[tuple[str, str]]], stays: bool
) -> Iterator[SubscribersOf]:
    """A function that returns the subscribers of an axis by its name: the dashboard.

    `entries` has the axes that exist from the beginning, with the entries of their matrices; `stays` serves the page
    after the run until Ctrl-C.
    """
    dashboard = dashboard_of(section, port)

    def hub(name: str) -> Subscriber:
        return dashboard.hub(name, entries.get(name, ()))

    for name in entries:
        hub(name)
    with dashboard:
        print_line(f"the dashboard is at {dashboard.url}")
        yield lambda name: (hub(name),)
        if stays:
            print_line(f"the run is finished; {dashboard.url} shows it until Ctrl-C")
            wait_for_the_end()


def wait_for_the_end() -> None:
    """Wait for Ctrl-C or SIGTERM."""
    ended = threading.Event()
    with calls_at_end(ended.set):
        while not ended.wait(0.2):  # a wait without a timeout blocks the signal on some platforms
            pass
