"""The receivers of a command: what a configuration has in [[publish]]."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from livebode.cli.serving import print_line
from livebode.configuration import Axes
from livebode.runtime import Destination, Subscriber

if TYPE_CHECKING:
    from livebode.publishing import Publisher


def outbox_of(directory: Path) -> Path:
    """The file with events that wait for delivery, beside the directory of a run."""
    return directory.with_name(f"{directory.name}.outbox.sqlite")


@contextmanager
def published(axes: Axes, directory: Path, alone: str, *, edited: bool) -> Iterator[Publisher | None]:
    """The publisher of these axes; None if none of them publishes, and the file cannot change that (`edited`).

    `alone` is the name under which a single axis publishes.
    """
    if not edited and not any(axis.publish for axis in axes.values()):
        yield None
        return
    from livebode.publishing import Publisher

    with Publisher(axes, outbox_of(directory), print_line, alone=alone) as publisher:
        yield publisher


def publishing_to(to: Destination, publisher: Publisher | None, name: str) -> Destination:
    """The destination of an axis, with the publisher as a subscriber."""
    if publisher is None:
        return to
    subscribers: tuple[Subscriber, ...] = (*to.subscribers, publisher.subscriber(name))
    return replace(to, subscribers=subscribers, findings=partial(publisher.findings, name))
