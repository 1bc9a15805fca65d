"""`livebode inspect` of a live source: what its address offers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from livebode.cli import terminal
from livebode.core import LivebodeError

if TYPE_CHECKING:
    from livebode.sources.live import Survey


def is_live(text: str) -> bool:
    """Whether a text is the address of a live source, by its scheme."""
    from livebode.plugins import named

    return text.partition(":")[0] in named("sources") and ":" in text


_NEEDS_KEYS = "config.key-missing", "config.secret-in-url", "source.refused"


def heard(url: str) -> Survey:
    """What comes from an address within some seconds; the error of one that needs keys says where to write them."""
    from livebode.sources.live import survey

    try:
        return survey(url)
    except LivebodeError as error:
        if error.code in _NEEDS_KEYS:
            error.remedy += (
                ". An address has no keys: write them under [source] of axis.toml, with the channels under [signals] "
                "(docs/how-to/live.md), and check the file by `livebode doctor axis.toml`"
            )
        raise


def show_survey(url: str, *, as_json: bool) -> None:
    """Listen to an address, and print its channels."""
    from dataclasses import asdict

    from livebode.records import to_json

    found = heard(url)
    if as_json:
        channels = [asdict(channel) for channel in found.channels]
        print(to_json({"source": found.source, "channels": channels, "trouble": found.trouble or None}))
        return
    list_channels(found)


def list_channels(heard: Survey) -> None:
    """Print the channels, their units, rates and newest values."""
    from rich.table import Table

    console = terminal.console(markup=False)
    rate = "" if heard.block is None else f" at {heard.rate_hz:.6g} Hz"
    foreign = " (messages of another program)" if "fields" in heard.source else ""
    console.print(f"{heard.source['url']}: {len(heard.channels)} channels{rate}{foreign}", soft_wrap=True)
    table = Table(box=None, header_style="bold")
    for heading in ("channel", "unit", "values/s", "example"):
        table.add_column(heading, justify="right" if heading in ("values/s", "example") else "left", overflow="fold")
    for channel in heard.channels:
        table.add_row(channel.name, channel.unit, f"{channel.rate_hz:.4g}", f"{channel.example:.6g}")
    if heard.channels:
        console.print(table)
    if heard.trouble:
        console.print(heard.trouble, soft_wrap=True)
