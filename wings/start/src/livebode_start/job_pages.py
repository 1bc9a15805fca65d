"""The requests of pages about jobs: how far one is, and its end."""

from __future__ import annotations

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import BaseRoute, Route

from livebode.dashboard import Board, Order, error_answer, json_object
from livebode.language import Message
from livebode.records import to_json
from livebode_start.jobs import Jobs


class JobPages:
    """The handlers of the routes.

    Parameters
    ----------
    jobs
        What they are about.
    board
        Access control.
    order
        The JSON of an operator, or the answer to somebody else.
    """

    def __init__(self, jobs: Jobs, board: Board, order: Order) -> None:
        self._jobs, self._access, self._order = jobs, board.access, order

    @property
    def routes(self) -> list[BaseRoute]:
        """All of them."""
        return [Route("/api/job", self.job), Route("/api/cancel", self.cancel, methods=["POST"])]

    async def job(self, request: Request) -> Response:
        """State, progress and output of the job of this id."""
        if self._access.role_of(request) is None:
            return JSONResponse(error_answer(Message("log in first")), 401)
        job = self._jobs.job(request.query_params.get("id"))
        return Response(to_json(job.plain()), media_type="application/json")

    async def cancel(self, request: Request) -> Response:
        """End a job as Ctrl-C would."""
        data = await self._order(request)
        if isinstance(data, Response):
            return data
        self._jobs.cancel(json_object(data).get("job"))
        return JSONResponse({})
