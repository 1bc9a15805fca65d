"""The pages that work in a directory of runs, and their requests."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

from starlette.responses import Response
from starlette.routing import BaseRoute

from livebode.dashboard import Board, Order


class StartPages:
    """Pages beside the list of runs.

    Parameters
    ----------
    directory
        Contains recordings, configurations and runs; it may be missing.
    """

    static, script = Path(__file__).parent / "static", "start.js"

    def __init__(self, directory: Path) -> None:
        self._directory = directory

    def routes(self, board: Board, file: Callable[[str], Response], order: Order) -> list[BaseRoute]:
        """Routes of the pages."""
        return []

    async def run(self) -> None:
        """Wait until it is cancelled."""
        await asyncio.Event().wait()
