"""Live addresses that a person names in the browser: listened to for some seconds, and then used like a recording."""

from __future__ import annotations

import asyncio
import re
from collections import OrderedDict
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from livebode.core import ServerError, UsageError
from livebode.language import Message, for_page
from livebode.plugins import named
from livebode.sources.live import Survey, parse_address, survey
from livebode_start.workspace import harmless_name

LISTENERS_MAX = 2
"""Addresses that are listened to at the same time."""
HEARD_MAX = 4
"""Addresses whose samples are in memory."""
_CHANNELS_MAX = 500


class Listening:
    """Listens to addresses, and retains what came last from some of them; for the thread of the server.

    Errors are those of `livebode inspect ADDRESS`.
    """

    def __init__(self) -> None:
        # Threads of its own: nobody waits for a silent machine to read a file.
        self._threads = ThreadPoolExecutor(LISTENERS_MAX, thread_name_prefix="livebode listening")
        self._busy: set[str] = set()
        self._heard: OrderedDict[str, Survey] = OrderedDict()

    async def listen(self, url: str) -> dict[str, Any]:
        """Listen to an address, and return for JSON: the address of the samples, its channels, and what is wrong.

        Raises
        ------
        ConfigError
            If it is not the address of a live source, or has a password.
        UsageError
            If it is that of a device of the server.
        ServerError
            If the address is listened to already, or as many as permitted.
        SourceError
            If nothing arrives, or the peer rejects the connection.
        """
        url = url.strip()
        place = str(_network_address(url))
        if place in self._busy or len(self._busy) >= LISTENERS_MAX:
            wrong = Message("{count} addresses are listened to already", count=len(self._busy))
            if place in self._busy:
                wrong = Message("{address} is listened to already", address=place)
            raise ServerError("busy", wrong, Message("try again in a moment"), limit=LISTENERS_MAX)
        self._busy.add(place)
        try:
            heard = await asyncio.get_running_loop().run_in_executor(self._threads, survey, url)
        finally:
            self._busy.discard(place)
        found = str(heard.source["url"])
        if heard.block is not None:
            self._heard[found] = heard
            self._heard.move_to_end(found)
            while len(self._heard) > HEARD_MAX:
                self._heard.popitem(last=False)
        trouble = heard.trouble or ("" if heard.block else Message("the channels have no samples in common"))
        return {"address": found, "usable": heard.block is not None, "trouble": for_page(trouble)} | shown(heard)

    def heard(self, name: object) -> Survey | None:
        """What came last from an address; None for one that is not in memory."""
        return self._heard.get(name) if isinstance(name, str) else None

    def close(self) -> None:
        """Stop the threads."""
        self._threads.shutdown(wait=False, cancel_futures=True)


def shown(heard: Survey) -> dict[str, Any]:
    """The channels of a survey for JSON, and whether their rate is only that of their arrival."""
    rows = heard.channels[:_CHANNELS_MAX]
    channels = [{"name": c.name, "unit": c.unit, "rate_hz": c.rate_hz, "newest": c.example} for c in rows]
    return {"heard": channels, "rate_measured": "rate_hz" in heard.source}


def stem_of(url: str) -> str:
    """The name of configuration and run of an address.

    >>> stem_of("mqtt://broker:1883/hall/press 3"), stem_of("udp://0.0.0.0:5000")
    ('press 3', 'udp-5000')
    """
    address = parse_address(url)
    last = address.path.rstrip("/").rpartition("/")[2]
    return harmless_name(last if re.search(r"\w", last) else f"{address.scheme}-{address.port}")


def _network_address(url: str) -> object:
    """The address, if it is on the network: a page must not open a device or a file of the server."""
    address = parse_address(url)
    if not address.host:
        kinds = [scheme for scheme, kind in named("sources").items() if not kind.device]
        raise UsageError(
            "not-one-of",
            Message("the page listens to addresses of the network only, and {address} is a device of this computer",
                    address=str(address)),
            Message("use {example} in a terminal, or give one of {schemes}", example=f"livebode inspect {address}",
                    schemes=", ".join(f"{scheme}://" for scheme in kinds)),
            argument="address",
        )  # fmt: skip
    return address
