"""The pages over all runs of a directory: list, trends, comparison, and the page of each run below /run/NAME/."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from typing import Any

from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Mount, Route
from starlette.types import ASGIApp, Receive, Scope, Send

from livebode.core import LivebodeError, ServerError, document_function
from livebode.dashboard import run_requests
from livebode.dashboard.access import Role, error_answer
from livebode.dashboard.board import Board
from livebode.dashboard.guard import body
from livebode.dashboard.opened_runs import OpenedRuns
from livebode.dashboard.run_catalogue import RunCatalogue, details
from livebode.language import Message, negotiated
from livebode.records import delete, to_json, write_notes

BODY_BYTES_MAX = 16 << 10
_COMPARISONS_MAX = 8
# A report is one file without scripts; its style and its drawings are in it.
_REPORT_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)


class RunsPages:
    """The handlers of the routes.

    Parameters
    ----------
    directory
        Contains the runs.
    board
        Without axes: access control, and the thread for long jobs.
    page
        Creates the application that serves the page of one board.
    file
        Answers with a static file.
    language
        Of pages whose user has not chosen one.
    """

    def __init__(
        self,
        directory: Path,
        board: Board,
        page: Callable[[Board], ASGIApp],
        file: Callable[[str], Response],
        language: str | None,
    ) -> None:
        self._catalogue, self._board = RunCatalogue(directory), board
        self._file, self._language = file, language
        self._opened = OpenedRuns(board.access, page)
        self._nobody = page(board)  # sends to the login
        self._comparisons: OrderedDict[Any, str] = OrderedDict()

    @property
    def routes(self) -> list[BaseRoute]:
        """All of them."""
        return [
            Route("/", self.list_page),
            Route("/trends", self.trends_page),
            Route("/compare", self.compare),
            Route("/api/runs", self.runs),
            Route("/api/trends", self.trends),
            Route("/api/trend", self.trend),
            Route("/api/notes", self.notes, methods=["POST"]),
            Route("/api/delete", self.delete, methods=["POST"]),
            Mount("/run/{name}", app=self.run),
        ]

    async def list_page(self, request: Request) -> Response:
        return self._html(request, "runs.html")

    async def trends_page(self, request: Request) -> Response:
        return self._html(request, "trends.html")

    async def runs(self, request: Request) -> Response:
        """Rows that changed since the version that the page has."""
        if (role := self._role(request)) is None:
            return _unknown()
        found = await self._board.elsewhere(self._catalogue.rows, run_requests.version(request.query_params))
        return _json(found | {"role": role, "directory": self._catalogue.directory.resolve().name})

    async def trends(self, request: Request) -> Response:
        """Points and alarms of runs that changed since the version that the page has."""
        if self._role(request) is None:
            return _unknown()
        found = await self._board.elsewhere(self._catalogue.trends, run_requests.version(request.query_params))
        return _json(found)

    async def trend(self, request: Request) -> Response:
        """Many points of one run, for a zoomed chart."""
        if self._role(request) is None:
            return _unknown()
        path = await self._path(request.query_params.get("run"))
        return _json({"quantities": await self._board.elsewhere(details, path)})

    async def compare(self, request: Request) -> Response:
        """The report of `livebode compare` on two runs."""
        if self._role(request) is None:
            return RedirectResponse("/login", 303)
        query = request.query_params
        before, after = [await self._path(query.get(name)) for name in ("before", "after")]
        accepted = request.headers.get("accept-language", "")
        code = negotiated(query.get("language", ""), self._language, accepted)
        text = await self._board.elsewhere(self._compared, before, after, code)
        return HTMLResponse(text, headers={"content-security-policy": _REPORT_POLICY})

    async def notes(self, request: Request) -> Response:
        if (refused := self._not_operator(request)) is not None:
            return refused
        name, notes = run_requests.notes_of(await body(request, BODY_BYTES_MAX))
        path = await self._path(name)
        await self._board.elsewhere(write_notes, path, notes)
        self._catalogue.forget()
        return JSONResponse({})

    async def delete(self, request: Request) -> Response:
        if (refused := self._not_operator(request)) is not None:
            return refused
        path = await self._path(run_requests.deletion_of(await body(request, BODY_BYTES_MAX)))
        to = await self._board.elsewhere(delete, path)
        self._opened.close(path.name)
        self._catalogue.forget()
        return JSONResponse({"to": str(to)})

    async def run(self, scope: Scope, receive: Receive, send: Send) -> None:
        """The page of one run, and all its requests."""
        if scope["type"] != "websocket":
            await self._run(scope, receive, send)
            return
        try:
            await self._run(scope, receive, send)
        except LivebodeError:  # a web socket has no answer that could say it; the page asks again
            await receive()
            await send({"type": "websocket.close", "code": 1013})

    async def _run(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers, address = Headers(scope=scope), scope["client"][0] if scope.get("client") else ""
        role = self._board.access.role(headers.get("cookie", ""), headers.get("authorization", ""), address)
        if role is None:
            await self._nobody(scope, receive, send)
            return
        path = await self._path(scope["path_params"]["name"])
        async with self._opened.opened(path) as page:
            await page(scope, receive, send)

    def _compared(self, before: Path, after: Path, code: str) -> str:
        key = code, *((path.name, (path / "run.json").stat().st_mtime_ns) for path in (before, after))
        if key not in self._comparisons:
            self._comparisons[key] = document_function("comparison")(before, after, code)
            while len(self._comparisons) > _COMPARISONS_MAX:
                self._comparisons.popitem(last=False)
        return self._comparisons[key]

    async def _path(self, name: object) -> Path:
        return await self._board.elsewhere(self._catalogue.path, run_requests.run_name(name))

    def _html(self, request: Request, name: str) -> Response:
        return RedirectResponse("/login", 303) if self._role(request) is None else self._file(name)

    def _role(self, request: Request) -> Role | None:
        headers, address = request.headers, request.client.host if request.client else ""
        return self._board.access.role(headers.get("cookie", ""), headers.get("authorization", ""), address)

    def _not_operator(self, request: Request) -> Response | None:
        """The answer to a request that this person may not make."""
        if (role := self._role(request)) is None:
            return _unknown()
        if role != "operator":
            return JSONResponse(error_answer(Message("this session is read-only")), 403)
        if request.headers.get("content-type", "").partition(";")[0] != "application/json":
            raise ServerError("request-malformed", "the request is not JSON", "send it with the type application/json")
        return None


def _json(value: dict[str, Any]) -> Response:
    return Response(to_json(value), media_type="application/json")


def _unknown() -> Response:
    return JSONResponse(error_answer(Message("log in first")), 401)
