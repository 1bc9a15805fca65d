"""The routes of the dashboard, and what a person saves with a run. GET requests change nothing."""

from __future__ import annotations

import html
import tempfile
from collections.abc import Callable, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any, get_args

from starlette.applications import Starlette
from starlette.background import BackgroundTask
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, JSONResponse, PlainTextResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket

from livebode import export
from livebode.core import LivebodeError, Responses, ServerError, remove_created
from livebode.dashboard import queries
from livebode.dashboard.access import COOKIE, SESSION_S, error_answer
from livebode.dashboard.alarm_requests import Act, alarm_request
from livebode.dashboard.board import Board
from livebode.dashboard.browser_socket import Client, serve_browser
from livebode.dashboard.frames import frame
from livebode.dashboard.guard import BODY_BYTES_MAX, Guard, body
from livebode.dashboard.past import Past
from livebode.dashboard.plugin_pages import (
    Answer,
    PluginPages,
    ShownRun,
    WorkspacePages,
    files_of_additions,
    page_additions,
)
from livebode.dashboard.queries import SavedChange
from livebode.dashboard.runs_pages import RunsPages
from livebode.dashboard.server_settings import ServerSettings
from livebode.dashboard.signals import signals
from livebode.dashboard.state import State
from livebode.dashboard.static_files import StaticFile, contents, static_files
from livebode.language import Message, catalogue_for_page, in_language, negotiated, tr, worded
from livebode.plugins import loaded
from livebode.records import SavedCurves, change_saved, read_saved


def listed(saved: SavedCurves) -> dict[str, Any]:
    """Names and times for the page; the curves themselves are sent as frames."""
    references = [
        {"id": item.id, "name": item.name, "saved": item.saved, "time_s": float(item.response.time_s[0])}
        for item in saved.references
    ]
    return {"references": references, "annotations": [vars(item) for item in saved.annotations]}


def applied(change: SavedChange, past: Past, state: State) -> Callable[[SavedCurves], SavedCurves]:
    """The change as a function; it reads the record, so it is called in another thread."""
    if change.kind == "annotation":
        return lambda saved: saved.with_annotation(change.text, change.value)
    if change.kind == "remove":
        return lambda saved: saved.without(change.text)
    quantities = state.quantities

    def add(saved: SavedCurves) -> SavedCurves:
        response = past.at(change.value)
        if quantities is None or not quantities.fit(response):
            raise ServerError("not-begun", "the response belongs to a previous run", "choose one of this run")
        return saved.with_reference(change.text, response)

    return add


_LANGUAGE = "language"
"""Cookie with the language that a person has chosen; the page sets it."""
_TYPES = {"csv": "text/csv; charset=utf-8", "mat": "application/octet-stream"}


def application(
    board: Board,
    serving: ServerSettings,
    directory: Path | None = None,
    others: PluginPages | None = None,
    workspaces: Mapping[str, WorkspacePages] | None = None,
) -> Guard:
    """The ASGI application: the page of the board, of a plug-in, or of all runs of a directory, each with a board.

    `workspaces` are the pages of plug-ins beside the list of runs, by name.
    """
    workspaces = workspaces or {}
    sources = contents(() if others is None else (others.static,)) | files_of_additions(workspaces)
    pages = _Pages(board, serving, static_files(sources))
    routes: list[BaseRoute] = [
        Route("/login", pages.login_page, methods=["GET"]),
        Route("/login", pages.login, methods=["POST"]),
        Route("/catalogue", pages.catalogue),
        Route("/logout", pages.logout, methods=["POST"]),
        Route("/static/{name:path}", pages.static),
    ]
    if others is not None:
        routes += others.routes(board, pages.file, pages.order)
    elif directory is None:
        routes += _page_routes(pages)
    else:
        routes += RunsPages(
            directory,
            board,
            lambda board: _app(_page_routes(_Pages(board, serving, pages.files)), serving.language),
            pages.file,
            serving.language,
        ).routes
        routes += [route for beside in workspaces.values() for route in beside.routes(board, pages.file, pages.order)]
    return Guard(_app(routes, serving.language), serving.names, serving.tls is not None)


def _app(routes: list[BaseRoute], language: str | None) -> Starlette:
    return Starlette(routes=routes, exception_handlers={LivebodeError: partial(_sorry, language)})


def _page_routes(pages: _Pages) -> list[BaseRoute]:
    """The page of one board."""
    return [
        Route("/", pages.page),
        Route("/api/past", pages.past),
        Route("/api/moment", pages.moment),
        Route("/api/signals", pages.signals),
        Route("/api/export", pages.export),
        *(Route(f"/api/{act}", partial(pages.act, act), methods=["POST"]) for act in get_args(Act)),
        Route("/api/saved", pages.saved, methods=["GET"]),
        Route("/api/saved", pages.change_saved, methods=["POST"]),
        WebSocketRoute("/live", pages.live),
        *pages.routes_of_additions(),
    ]


class _Pages:
    """The handlers of the routes."""

    def __init__(self, board: Board, serving: ServerSettings, files: Mapping[str, StaticFile]) -> None:
        self._board, self._secure, self._language = board, serving.tls is not None, serving.language
        self.files = files

    async def page(self, request: Request) -> Response:
        if self._board.access.role_of(request) is None:
            return RedirectResponse("/login", 303)
        return self.file("index.html")

    async def login_page(self, _request: Request) -> Response:
        return self.file("login.html")

    async def login(self, request: Request) -> Response:
        data = await body(request)
        token = None if data is None else queries.json_object(data).get("token")
        if not isinstance(token, str):
            raise ServerError("request-malformed", "the login has no token", "send an object with the text token")
        session = self._board.access.login(token, _address(request))
        if session is None:
            return JSONResponse(error_answer(Message("this token is wrong")), 401)
        answer = JSONResponse({})
        answer.set_cookie(
            COOKIE, session, max_age=int(SESSION_S), httponly=True, samesite="strict", secure=self._secure
        )
        return answer

    async def catalogue(self, request: Request) -> Response:
        """The language of the page; also for the login, so without access control."""
        chosen, accepted = request.cookies.get(_LANGUAGE, ""), request.headers.get("accept-language", "")
        return _catalogue(negotiated(chosen, self._language, accepted))

    async def logout(self, request: Request) -> Response:
        self._board.access.logout(request.headers.get("cookie", ""))
        answer = JSONResponse({})
        answer.delete_cookie(COOKIE, httponly=True, samesite="strict", secure=self._secure)
        return answer

    async def static(self, request: Request) -> Response:
        return self.file(request.path_params["name"])

    async def past(self, request: Request) -> Response:
        """Rows of a span of time."""
        if (state := self._asked_state(request)) is None:
            return _unknown()
        span, past = queries.span(request.query_params, len(self._board.states)), Past.of(state)
        rows = await self._board.elsewhere(past.between, span.from_s, span.to_s, span.rows)
        return Response(frame("history", span.axis, _as(state, rows, span)), media_type="application/octet-stream")

    async def moment(self, request: Request) -> Response:
        """The response nearest to a time, with its overlays."""
        if (state := self._asked_state(request)) is None:
            return _unknown()
        span = queries.span(request.query_params, len(self._board.states))
        response = await self._board.elsewhere(Past.of(state).at, span.from_s)
        data = state.frames_at(response, span.quantity)
        return Response(data, media_type="application/octet-stream")

    async def signals(self, request: Request) -> Response:
        """Raw signals or their spectrum, live or at a time in the record."""
        if self._board.access.role_of(request) is None:
            return _unknown()
        asked = queries.signals_asked(request.query_params, len(self._board.states))
        answer = await signals(self._board, self._begun(asked.axis), asked)
        return Response(answer, media_type="application/octet-stream")

    def routes_of_additions(self) -> list[BaseRoute]:
        """The requests that the additions of the page answer, from one object of each for this board."""
        answers = {name: answer for kind in page_additions().values() for name, answer in kind().answers().items()}
        return [Route(f"/api/{name}", partial(self._addition, answer)) for name, answer in answers.items()]

    async def _addition(self, answer: Answer, request: Request) -> Response:
        if (state := self._asked_state(request)) is None:
            return _unknown()
        assert state.quantities is not None  # the run has begun
        group, states = state.group, self._board.states
        units = [[_unit(states[group.axis(o, i)]) for i in group.inputs] for o in group.outputs] if group else []
        run = ShownRun(state.axis, Past.of(state), state.quantities, dict(state.summary), group, units)
        return JSONResponse(await self._board.elsewhere(answer, run, request.query_params))

    async def export(self, request: Request) -> Response:
        """Responses of a span of time as a file; a single response if the span has no length."""
        if (state := self._asked_state(request)) is None:
            return _unknown()
        span, past = queries.span(request.query_params, len(self._board.states)), Past.of(state)

        def write() -> Path:
            parts = past.all_between(span.from_s, span.to_s) if span.to_s > span.from_s else [past.at(span.from_s)]
            with tempfile.NamedTemporaryFile(suffix=f".{span.format}", delete=False) as file:
                path = Path(file.name)
            try:
                write_responses = loaded(export.writers("responses")[span.format])
                write_responses(path, (_as(state, part, span) for part in parts), {})
            except BaseException:
                remove_created(path)
                raise
            return path

        path = await self._board.elsewhere(write)
        name = f"{span.quantity.replace(' ', '-')}-{span.from_s:.6g}s.{span.format}"
        return FileResponse(
            path, media_type=_TYPES[span.format], filename=name, background=BackgroundTask(remove_created, path)
        )

    async def act(self, act: Act, request: Request) -> Response:
        """Acknowledge, shelve or unshelve an alarm."""
        data = await self.order(request)
        if isinstance(data, Response):
            return data
        self._board.act(act, alarm_request(data, len(self._board.states), act))
        return JSONResponse({}, 202)

    async def saved(self, request: Request) -> Response:
        """The references and annotations that are saved with a run."""
        if (state := self._asked_state(request)) is None:
            return _unknown()
        if state.entry is not None:
            return JSONResponse(listed(SavedCurves()))  # the file of a run does not name entries
        return JSONResponse(listed(await self._board.elsewhere(read_saved, _directory(state))))

    async def change_saved(self, request: Request) -> Response:
        """Save a reference or an annotation with a run, or remove one."""
        data = await self.order(request)
        if isinstance(data, Response):
            return data
        change = queries.saved_change(data, len(self._board.states))
        state = self._begun(change.axis)
        if state.entry is not None:
            raise ServerError(
                "entry-only", "nothing can be saved with one entry of a matrix run", "copy a link instead"
            )
        job = applied(change, Past.of(state), state)
        return JSONResponse(listed(await self._board.elsewhere(change_saved, _directory(state), job)))

    async def order(self, request: Request, bytes_max: int = BODY_BYTES_MAX) -> bytes | Response:
        """The JSON of an operator, of at most so many bytes, or the answer to somebody else."""
        role = self._board.access.role_of(request)
        if role is None:
            return _unknown()
        if role != "operator":
            return JSONResponse(error_answer(Message("this session is read-only")), 403)
        data = await body(request, bytes_max)
        if data is None or request.headers.get("content-type", "").partition(";")[0] != "application/json":
            raise ServerError(
                "request-malformed",
                "the request is not a short JSON object",
                "send it with the type application/json",
            )
        return data

    async def live(self, socket: WebSocket) -> None:
        await serve_browser(self._board, socket, lambda role: Client(self._board, socket, role))

    def file(self, name: str) -> Response:
        """A static file."""
        return self.files.get(name) or PlainTextResponse("not found\n", 404)

    def _asked_state(self, request: Request) -> State | None:
        """The state of the axis of a query, if its run has started; None without access."""
        if self._board.access.role_of(request) is None:
            return None
        return self._begun(queries.span(request.query_params, len(self._board.states)).axis)

    def _begun(self, axis: int) -> State:
        state = self._board.states[axis]
        state.refresh()
        if state.quantities is None:
            raise ServerError("not-begun", Message("the run has not begun"), Message("wait for its first samples"))
        return state


@cache
def _catalogue(code: str) -> StaticFile:
    return StaticFile(catalogue_for_page(code), "application/json", vary="accept-language, cookie")


def _as(state: State, responses: Responses, span: queries.Span) -> Responses:
    assert state.quantities is not None
    return state.quantities.of_responses(responses, span.quantity)


def _unit(state: State) -> str:
    return "" if state.quantities is None else state.quantities.unit


def _directory(state: State) -> Path:
    assert state.directory is not None  # the run has begun
    return state.directory


def _address(request: Request) -> str:
    return request.client.host if request.client else ""


def _unknown() -> Response:
    return JSONResponse(error_answer(Message("log in first")), 401)


async def _sorry(language: str | None, request: Request, error: Exception) -> Response:
    """The error for a script, or as a page for a person who opened an address."""
    pause_s = error.facts.get("retry_after_s") if isinstance(error, LivebodeError) else None
    status, headers = (400, {}) if pause_s is None else (429, {"retry-after": str(pause_s)})
    accepted = request.headers
    if request.method != "GET" or "text/html" not in accepted.get("accept", ""):
        return JSONResponse(error_answer(error), status, headers)
    code = negotiated(request.query_params.get("language", ""), language, accepted.get("accept-language", ""))
    with in_language(code):
        sentence, back = worded(getattr(error, "words", str(error))), tr("All runs")
    of_runs = request.url.path.startswith(("/run/", "/compare"))
    text = _ERROR_PAGE.format(
        code=code, sentence=html.escape(sentence), back=f'<p><a class="back" href="/">{back}</a></p>' if of_runs else ""
    )
    return HTMLResponse(text, status, headers)


_ERROR_PAGE = """<!doctype html>
<html lang="{code}">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>livebode</title>
<link rel="icon" href="/static/icon.svg" type="image/svg+xml">
<link rel="stylesheet" href="/static/look.css">
<link rel="stylesheet" href="/static/layout.css">
<link rel="stylesheet" href="/static/panels.css">
<script type="module" src="/static/error.js"></script>
</head>
<body>
<main class="card login">
  <h1 class="brand"><span aria-hidden="true" class="mark"></span>livebode</h1>
  <p class="wrong" role="alert">{sentence}</p>
  {back}
</main>
</body>
</html>
"""
