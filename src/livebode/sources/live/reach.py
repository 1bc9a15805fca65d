"""Reach: whether a machine can be reached."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import Any, Literal

from livebode.dataclass import dataclass
from livebode.sources.live.address import Address

TIMEOUT_S = 3.0


@dataclass(frozen=True)
class Reach:
    """Whether a machine can be reached.

    Attributes
    ----------
    verdict
        "not applicable" where it cannot be known before the run begins.
    message
        One sentence with the address.
    remedy
        What to do, as an imperative; empty where nothing has to be done.
    facts
        The values as plain data.
    """

    verdict: Literal["not applicable", "ok", "failed"]
    message: str
    remedy: str = ""
    facts: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def by(cls, connect: Callable[[], object], address: Address) -> Reach:
        """By a connection, which `connect` opens within `TIMEOUT_S`, and closes."""
        facts = {"address": str(address), "timeout_s": TIMEOUT_S}
        try:
            connect()
        except OSError as error:
            late = f"no answer within {TIMEOUT_S:g} s"
            why = late if isinstance(error, TimeoutError) else error.strerror or str(error)
            remedy = "check that it is switched on, its address in source.url, and the firewall"
            return cls("failed", f"{address}: {why}", remedy, facts)
        return cls("ok", f"{address} accepts connections", facts=facts)
