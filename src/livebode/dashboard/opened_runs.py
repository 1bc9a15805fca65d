"""The runs of a directory whose pages are open: read when they are asked for, and closed again, the oldest first."""

from __future__ import annotations

import asyncio
import os
from collections import OrderedDict
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path

from starlette.types import ASGIApp

from livebode.core import ServerError
from livebode.dashboard.access import Access
from livebode.dashboard.board import Board
from livebode.dashboard.matrix_view import views_of

OPEN_MAX = 8
"""Largest number of runs in memory."""


@dataclass(eq=False)
class _OpenedRun:
    """A run in memory: its board, the page over it, and how many requests use it now."""

    board: Board
    page: ASGIApp
    beating: asyncio.Task[None]
    directory: tuple[int, int]
    users: int = 0


@dataclass
class OpenedRuns:
    """The runs in memory, at most 8; used in the server's thread.

    Parameters
    ----------
    access
        The access control of their boards.
    page
        Creates the application that serves a board.
    """

    access: Access
    page: Callable[[Board], ASGIApp]
    _runs: OrderedDict[str, _OpenedRun] = field(default_factory=OrderedDict)
    _opening: asyncio.Lock = field(default_factory=asyncio.Lock)

    @asynccontextmanager
    async def opened(self, directory: Path) -> AsyncIterator[ASGIApp]:
        """The application of a run, which stays in memory at least as long as the context.

        Raises
        ------
        RecordError, GridError
            If the run cannot be read.
        ServerError
            If 8 other runs are in use.
        """
        async with self._opening:
            found = self._runs.get(directory.name)
            # Another run of the same name, or an internal error has stopped it.
            if found is not None and (found.directory != _identity(directory) or found.beating.done()):
                self.close(directory.name)
                found = None
            if found is None:
                self._make_room()
                found = self._runs[directory.name] = await self._open(directory)
        self._runs.move_to_end(directory.name)
        found.users += 1
        try:
            yield found.page
        finally:
            found.users -= 1

    def close(self, name: str) -> None:
        """Remove a run from memory and disconnect its browsers."""
        if (found := self._runs.pop(name, None)) is not None:
            found.board.places.displace_all()
            found.beating.cancel()
            found.board.close()

    async def _open(self, directory: Path) -> _OpenedRun:
        identity = _identity(directory)
        views = await asyncio.get_running_loop().run_in_executor(None, views_of, directory)
        board = Board([state for state, _ in views], {state.axis: viewed for state, viewed in views}, self.access)
        return _OpenedRun(board, self.page(board), asyncio.create_task(board.run()), identity)

    def _make_room(self) -> None:
        if len(self._runs) < OPEN_MAX:
            return
        idle = next((name for name, run in self._runs.items() if not run.users), None)
        if idle is None:
            raise ServerError(
                "busy", f"{OPEN_MAX} runs are open in browsers already", "close the page of one of them", limit=OPEN_MAX
            )
        self.close(idle)


def _identity(directory: Path) -> tuple[int, int]:
    found = os.stat(directory)
    return found.st_dev, found.st_ino
