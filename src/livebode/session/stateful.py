"""Stateful: what can go on where it was."""

from __future__ import annotations

from typing import Protocol


class Stateful(Protocol):
    """Gives all that its next result depends on as bytes, and goes on from them."""

    def snapshot(self) -> bytes: ...

    def restore(self, snapshot: bytes) -> None: ...
