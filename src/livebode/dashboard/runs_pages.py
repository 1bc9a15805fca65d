"""The pages over all runs of a directory: list, trends, comparison, their requests, and the page of each run below
/run/NAME/, which is opened when it is asked for.
"""

from __future__ import annotations

import asyncio
import os
from collections import OrderedDict
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import field
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from starlette.requests import HTTPConnection, Request
from starlette.responses import HTMLResponse, JSONResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Mount, Route
from starlette.types import ASGIApp, Receive, Scope, Send

from livebode.core import LivebodeError, ServerError, UsageError, document_function
from livebode.dashboard.access import Access, error_answer
from livebode.dashboard.board import Board
from livebode.dashboard.guard import body
from livebode.dashboard.queries import json_object
from livebode.dashboard.run_catalogue import RunCatalogue, details
from livebode.dashboard.run_feed import views_of
from livebode.dataclass import dataclass
from livebode.language import Message, negotiated
from livebode.records import Notes, delete, summary_path, to_json, write_notes

NAME_LETTERS_MAX = 255
VERSION_MAX = 1 << 53  # the largest whole number that JavaScript represents exactly


def version(query: Mapping[str, str]) -> int:
    """The version that the page has; 0 without one.

    >>> version({"since": "12"}), version({})
    (12, 0)
    """
    text = query.get("since", "0")
    if not (text.isascii() and text.isdigit() and len(text) <= 16 and int(text) <= VERSION_MAX):
        raise UsageError(
            "unreadable", f"since={text[:20]!r} is not a version", Message("reload the page"), value=text[:20]
        )
    return int(text)


def run_name(value: object) -> str:
    """The name of a run in a request."""
    if not isinstance(value, str) or not 0 < len(value) <= NAME_LETTERS_MAX:
        raise ServerError("request-malformed", "the request does not name a run", Message("reload the page"))
    return value


def notes_of(data: bytes | None) -> tuple[str, Notes]:
    """Name and notes of a request; LivebodeError if they are invalid."""
    message = _object(data)
    try:
        notes = Notes.model_validate({name: message.get(name) for name in ("tags", "text")})
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise ServerError(
            "request-malformed",
            f"the notes are not valid ({place}: {first['msg']})",
            "shorten them: at most 20 tags of 40 letters, and 2,000 letters of notes",
        ) from None
    return run_name(message.get("run")), notes


def deletion_of(data: bytes | None) -> str:
    """Name of the run to delete; ServerError if the person did not confirm it by its name."""
    message = _object(data)
    name = run_name(message.get("run"))
    if message.get("confirmed") != name:
        raise ServerError("request-malformed", f"the deletion of {name[:80]!r} is not confirmed", "enter its name")
    return name


def _object(data: bytes | None) -> dict[str, Any]:
    if data is None:
        raise ServerError("request-malformed", "the request is too long or incomplete", "send a shorter one")
    return json_object(data)


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
            run = self._runs.get(directory.name)
            # Another run of the same name, or an internal error has stopped it.
            if run is not None and (run.directory != _identity(directory) or run.beating.done()):
                self.close(directory.name)
                run = None
            if run is None:
                self._make_room()
                run = self._runs[directory.name] = await self._open(directory)
        self._runs.move_to_end(directory.name)
        run.users += 1
        try:
            yield run.page
        finally:
            run.users -= 1

    def close(self, name: str) -> None:
        """Remove a run from memory and disconnect its browsers."""
        if (run := self._runs.pop(name, None)) is not None:
            run.board.places.displace_all()
            run.beating.cancel()
            run.board.close()

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
    status = os.stat(directory)
    return status.st_dev, status.st_ino


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
        if (role := self._board.access.role_of(request)) is None:
            return _unknown()
        rows = await self._board.elsewhere(self._catalogue.rows, version(request.query_params))
        return _json(rows | {"role": role, "directory": self._catalogue.directory.resolve().name})

    async def trends(self, request: Request) -> Response:
        """Points and alarms of runs that changed since the version that the page has."""
        if self._board.access.role_of(request) is None:
            return _unknown()
        trends = await self._board.elsewhere(self._catalogue.trends, version(request.query_params))
        return _json(trends)

    async def trend(self, request: Request) -> Response:
        """Many points of one run, for a zoomed chart."""
        if self._board.access.role_of(request) is None:
            return _unknown()
        path = await self._path(request.query_params.get("run"))
        return _json({"quantities": await self._board.elsewhere(details, path)})

    async def compare(self, request: Request) -> Response:
        """The report of `livebode compare` on two runs."""
        if self._board.access.role_of(request) is None:
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
        name, notes = notes_of(await body(request, BODY_BYTES_MAX))
        path = await self._path(name)
        await self._board.elsewhere(write_notes, path, notes)
        self._catalogue.forget()
        return JSONResponse({})

    async def delete(self, request: Request) -> Response:
        if (refused := self._not_operator(request)) is not None:
            return refused
        path = await self._path(deletion_of(await body(request, BODY_BYTES_MAX)))
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
        if self._board.access.role_of(HTTPConnection(scope)) is None:
            await self._nobody(scope, receive, send)
            return
        path = await self._path(scope["path_params"]["name"])
        async with self._opened.opened(path) as page:
            await page(scope, receive, send)

    def _compared(self, before: Path, after: Path, code: str) -> str:
        key = code, *((path.name, summary_path(path).stat().st_mtime_ns) for path in (before, after))
        if key not in self._comparisons:
            self._comparisons[key] = document_function("comparison")(before, after, code)
            while len(self._comparisons) > _COMPARISONS_MAX:
                self._comparisons.popitem(last=False)
        return self._comparisons[key]

    async def _path(self, name: object) -> Path:
        return await self._board.elsewhere(self._catalogue.path, run_name(name))

    def _html(self, request: Request, name: str) -> Response:
        return RedirectResponse("/login", 303) if self._board.access.role_of(request) is None else self._file(name)

    def _not_operator(self, request: Request) -> Response | None:
        """The answer to a request that this person may not make."""
        if (role := self._board.access.role_of(request)) is None:
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
