"""The receivers of a configuration, and a test message to each: `livebode doctor --receivers`."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from livebode.core import LivebodeError, PublishError

if TYPE_CHECKING:
    from livebode.configuration import PublishSection
    from livebode.publishing import EventMessage


def show_receivers(configuration: Path, *, test: bool, as_json: bool) -> None:
    """Print one line for each [[publish]] section: what is sent, or the result of a test message.

    Raises
    ------
    PublishError
        If the configuration has no such section.
    typer.Exit
        With code 2 if a test failed.
    """
    from livebode.configuration import ConfigurationFile
    from livebode.publishing import exposure, sections_of
    from livebode.records import to_json

    sections = sections_of(ConfigurationFile(configuration, {}).read())
    if not sections:
        raise PublishError(
            "nothing-configured",
            f"{configuration} has no [[publish]] section",
            'add one with kind = "…" and url = "…"',
            path=str(configuration),
        )
    results: list[dict[str, Any]] = []
    for label, section in sections.items():
        found = _tested(section) if test else {"sentence": _description(section)}
        if (shown := exposure(section)) is not None:
            found["exposure"] = shown
        results.append({"name": label, "kind": section.kind} | found)
        if not as_json:
            for sentence in (found["sentence"], *([shown] if shown else [])):
                print(f"{label}: {sentence}", flush=True)
    if as_json:
        print(to_json({"receivers": results}))
    if any("error" in result for result in results):
        raise typer.Exit(2)


def _description(section: PublishSection) -> str:
    """What is sent to it."""
    events, values = " ".join(section.sent_events), " and ".join(section.sent_values)
    sent = [f"events ({events})"] if events else []
    return "; ".join([*sent, *([f"{values} every {section.interval_s:g} s"] if values else [])])


def _tested(section: PublishSection) -> dict[str, Any]:
    """The result of a test message."""
    from livebode.publishing import open_sink

    begun_s = time.perf_counter()
    try:
        sink = open_sink(section)
        try:
            if section.sent_events:
                sink.send_events([_message()])
            else:
                sink.send_values([])
        finally:
            sink.close()
    except LivebodeError as error:
        return {"sentence": f"not delivered: {error}", "error": error.as_dict()}
    return {"sentence": f"delivered in {1e3 * (time.perf_counter() - begun_s):.0f} ms"}


def _message() -> EventMessage:
    """The test message; each has its own id, so that no receiver takes it for a repetition."""
    from livebode.publishing import EventMessage

    now_s = time.time()
    message = "This is a test message of livebode; nothing has happened."
    return EventMessage(f"test-{now_s:.3f}", "test", "", "", "test", "event", "info", "test", message, now_s, 0)
