"""The page from a recording to a run, and its requests."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from starlette.requests import Request
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route

from livebode.core import ServerError, write_whole, writing
from livebode.dashboard import Board, Order, error_answer, json_object, upload
from livebode.language import Message
from livebode.records import to_json
from livebode_start.jobs import JobOrder, Jobs
from livebode_start.listening import Listening, stem_of
from livebode_start.preview import POINTS_MAX
from livebode_start.recordings import Choices, OpenedRecording, OpenedRecordings
from livebode_start.results import Results
from livebode_start.uploads import UPLOAD_BYTES_MAX, Uploads
from livebode_start.workspace import Workspace

CHOICES_BYTES_MAX = 64 << 10
_WAITING_MAX = 16
T = TypeVar("T")


class MeasurePages:
    """The handlers of the routes.

    Parameters
    ----------
    workspace
        With the recordings.
    jobs
        Runs the command.
    board
        Access control.
    file
        Answers with a static file.
    order
        The JSON of an operator, or the answer to somebody else.
    """

    def __init__(
        self, workspace: Workspace, jobs: Jobs, board: Board, file: Callable[[str], Response], order: Order
    ) -> None:
        self._workspace, self._jobs = workspace, jobs
        self._access, self._file, self._order = board.access, file, order
        self._uploads, self._recordings = Uploads(workspace), OpenedRecordings()
        self._listening = Listening()
        # A reader of its own: a long recording does not delay the list of runs.
        self._reader = ThreadPoolExecutor(1, thread_name_prefix="livebode recordings")
        self._waiting = 0

    @property
    def routes(self) -> list[BaseRoute]:
        """All of them."""
        return [
            Route("/measure", self.page),
            Route("/api/recordings", partial(self._known, self.recordings)),
            Route("/api/recording", partial(self._known, self.recording)),
            Route("/api/preview", partial(self._known, self.preview)),
            Route("/api/upload", self.upload, methods=["POST"]),
            Route("/api/listen", self.listen, methods=["POST"]),
            Route("/api/configuration", self.configuration, methods=["POST"]),
            Route("/api/measure", self.measure, methods=["POST"]),
        ]

    async def page(self, request: Request) -> Response:
        return RedirectResponse("/login", 303) if self._access.role_of(request) is None else self._file("measure.html")

    async def _known(self, answer: Callable[[Request], Awaitable[Any]], request: Request) -> Response:
        """The answer to somebody who has logged in."""
        if self._access.role_of(request) is None:
            return JSONResponse(error_answer(Message("log in first")), 401)
        return _json(await answer(request))

    async def recordings(self, _: Request) -> Any:
        """The recordings in the directory, and the largest one that can be sent."""
        return {"recordings": await self._read(self._workspace.recordings), "bytes_max": UPLOAD_BYTES_MAX}

    async def recording(self, request: Request) -> Any:
        """Channels and proposed roles of a recording."""
        query = request.query_params
        return await self._read(lambda: self._opened(query.get("recording"), _number(query.get("rate_hz"))).plain())

    async def preview(self, request: Request) -> Any:
        """A channel over a span of time."""
        query = request.query_params
        points = min(max(int(_number(query.get("points")) or 1), 1), POINTS_MAX)

        def job() -> dict[str, Any]:
            opened, name = self._opened(query.get("recording"), _number(query.get("rate_hz"))), query.get("channel", "")
            if name not in opened.overview.names:
                raise ServerError("request-malformed", f"there is no channel {name[:80]!r}", Message("reload the page"))
            log = opened.log
            begin_s, end_s = _number(query.get("from")), _number(query.get("to"))
            begin_s = log.origin_s if begin_s is None else begin_s
            end_s = log.origin_s + opened.stop / log.rate_hz if end_s is None else end_s
            return opened.overview.plain(name, begin_s, end_s, points)

        return await self._read(job)

    async def upload(self, request: Request) -> Response:
        """Receive a recording of an operator, whose content is the body and whose name is a parameter."""
        role = self._access.role_of(request)
        if role is None:
            return JSONResponse(error_answer(Message("log in first")), 401)
        if role != "operator":
            return JSONResponse(error_answer(Message("this session is read-only")), 403)
        length = request.headers.get("content-length")
        name = request.query_params.get("name", "")
        size_bytes = int(length) if length is not None else None
        return _json({"recording": await self._uploads.receive(name, size_bytes, upload(request))})

    async def listen(self, request: Request) -> Response:
        """Listen to the address that an operator names; nothing is written."""
        data = await self._order(request, CHOICES_BYTES_MAX)
        if isinstance(data, Response):
            return data
        address = json_object(data).get("address")
        return _json(await self._listening.listen(address if isinstance(address, str) else ""))

    async def configuration(self, request: Request) -> Response:
        """The axis.toml of an operator's choices; nothing is written."""
        data = await self._order(request, CHOICES_BYTES_MAX)
        if isinstance(data, Response):
            return data
        choices = Choices.read(data)
        return _json(await self._read(lambda: self._proposed(choices)[1]))

    async def measure(self, request: Request) -> Response:
        """Write the axis.toml of an operator's choices, and start its run."""
        data = await self._order(request, CHOICES_BYTES_MAX)
        if isinstance(data, Response):
            return data
        choices = Choices.read(data)

        def job() -> dict[str, Any]:
            stem, answer = self._proposed(choices)
            path = self._workspace.directory / f"{stem}.toml"

            def prepare() -> None:
                with writing(path):
                    path.parent.mkdir(parents=True, exist_ok=True)  # nothing was sent to it yet, with a live source
                    write_whole(path, answer["text"].encode())

            arguments = ("run", path.name, f"--out={stem}")
            return {"job": self._jobs.start(JobOrder("measure", arguments, prepare)).id, "run": stem}

        return _json(await self._read(job))

    def close(self) -> None:
        """Stop the threads."""
        self._listening.close()
        self._reader.shutdown(wait=False, cancel_futures=True)

    def _opened(self, name: object, rate_hz: float | None) -> OpenedRecording:
        if (heard := self._listening.heard(name)) is not None:
            return self._recordings.of_heard(heard, rate_hz)
        return self._recordings.open(self._workspace.path(name), str(name), rate_hz)

    def _proposed(self, choices: Choices) -> tuple[str, dict[str, Any]]:
        """Name of configuration and run, and the answer to the page."""
        opened = self._opened(choices.recording, choices.rate_hz)
        if choices.baseline:
            Results(self._workspace.directory).check("baselines", choices.baseline)
        stem = self._workspace.free_stem(Path(opened.name).stem if opened.heard is None else stem_of(opened.name))
        answer = opened.proposed(choices).plain(opened.name)
        return stem, answer | {"command": f"livebode run {stem}.toml --out={stem}", "file": f"{stem}.toml"}

    async def _read(self, job: Callable[[], T]) -> T:
        """Run a job in the reading thread; its errors name files without their directory."""

        def named() -> T:
            with self._workspace.short_names():
                return job()

        if self._waiting >= _WAITING_MAX:
            raise ServerError("busy", Message("too many requests wait already"), Message("try again in a moment"))
        self._waiting += 1
        try:
            return await asyncio.get_running_loop().run_in_executor(self._reader, named)
        finally:
            self._waiting -= 1


def _json(value: Any) -> Response:
    return Response(to_json(value), media_type="application/json")


def _number(text: str | None) -> float | None:
    """A finite number of a query; ServerError for any other text."""
    try:
        number = None if text is None else float(text)
    except ValueError:
        number = float("nan")
    if number is not None and not abs(number) < float("inf"):
        raise ServerError("request-malformed", f"{str(text)[:40]!r} is not a number", Message("reload the page"))
    return number
