"""The pages that work in a directory of runs, and their requests."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

from starlette.responses import Response
from starlette.routing import BaseRoute

from livebode.dashboard import Board, Order
from livebode_start.job_pages import JobPages
from livebode_start.jobs import Jobs
from livebode_start.measure_pages import MeasurePages
from livebode_start.task_pages import TaskPages
from livebode_start.uploads import remove_abandoned
from livebode_start.workspace import Workspace


class StartPages:
    """Pages beside the list of runs.

    Parameters
    ----------
    directory
        Contains recordings, configurations and runs; it may be missing.
    """

    static, script = Path(__file__).parent / "static", "start.js"

    def __init__(self, directory: Path) -> None:
        self._workspace = Workspace(directory)
        remove_abandoned(self._workspace.directory)
        self._jobs = Jobs(self._workspace.directory)
        self._measure: MeasurePages | None = None

    def routes(self, board: Board, file: Callable[[str], Response], order: Order) -> list[BaseRoute]:
        """Routes of the pages."""
        measure = self._measure = MeasurePages(self._workspace, self._jobs, board, file, order)
        tasks = TaskPages(self._workspace.directory, self._jobs, board, file, order)
        return [*JobPages(self._jobs, board, order).routes, *measure.routes, *tasks.routes]

    async def run(self) -> None:
        """Wait until it is cancelled; then end the reading and the jobs."""
        try:
            await asyncio.Event().wait()
        finally:
            if self._measure is not None:
                self._measure.close()
            self._jobs.close()
