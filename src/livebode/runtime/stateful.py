"""Stateful: interface of stages that can be continued."""

from __future__ import annotations

from typing import Protocol


class Stateful(Protocol):
    """Stores all state that the next result depends on as bytes, and continues from them."""

    def snapshot(self) -> bytes: ...

    def restore(self, snapshot: bytes) -> None: ...
