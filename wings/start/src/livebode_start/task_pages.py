"""The page of the tasks beside measuring, and its requests."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

from starlette.requests import Request
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route

from livebode.core import ServerError
from livebode.dashboard import Board, Order, error_answer, json_object, runs_in
from livebode.language import Message
from livebode.records import to_json
from livebode_start.jobs import Jobs
from livebode_start.results import Results
from livebode_start.tasks import TaskRequest, check_request, fields_of, limit_fields, offered, task_named

REQUEST_BYTES_MAX = 256 << 10
# A report has no scripts; its style and its drawings are in it.
_REPORT_POLICY = (
    "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)


class TaskPages:
    """The handlers of the routes.

    Parameters
    ----------
    directory
        Of the runs.
    jobs
        Runs the commands.
    board
        Access control, and the thread that reads.
    file
        Answers with a static file.
    order
        The JSON of an operator, or the answer to somebody else.
    """

    def __init__(
        self, directory: Path, jobs: Jobs, board: Board, file: Callable[[str], Response], order: Order
    ) -> None:
        self._directory, self._jobs, self._board, self._order = directory, jobs, board, order
        self._file, self._results = file, Results(directory)

    @property
    def routes(self) -> list[BaseRoute]:
        """All of them."""
        return [
            Route("/task", self.page),
            Route("/api/tasks", self.tasks),
            Route("/api/task", self.task, methods=["GET"]),
            Route("/api/task", self.start, methods=["POST"]),
            Route("/result/{task}/{name}/{file}", self.result),
        ]

    async def page(self, request: Request) -> Response:
        return (
            RedirectResponse("/login", 303) if self._board.access.role_of(request) is None else self._file("task.html")
        )

    async def tasks(self, request: Request) -> Response:
        """The tasks that are offered, and the jobs that are remembered."""
        if (role := self._board.access.role_of(request)) is None:
            return _unknown()
        jobs = [job.plain() | {"output": ""} for job in self._jobs.listed()]
        return _json({"tasks": offered(), "jobs": jobs, "role": role})

    async def task(self, request: Request) -> Response:
        """The fields of a task, and the results that are here."""
        if (role := self._board.access.role_of(request)) is None:
            return _unknown()
        name = request.query_params.get("task", "")
        task = task_named(name)

        def job() -> dict[str, Any]:
            return {
                "fields": [known._asdict() for known in fields_of(name)],
                "limits": [known._asdict() for known in limit_fields()] if name == "report" else [],
                "results": self._results.listed(task.folder),
            }

        return _json(await self._board.elsewhere(job) | {"role": role, "runs": list(task.runs)})

    async def start(self, request: Request) -> Response:
        """Start the job of an operator."""
        data = await self._order(request, REQUEST_BYTES_MAX)
        if isinstance(data, Response):
            return data
        asked = json_object(data)

        def job() -> str:
            name = asked.get("task")
            task = task_named(name)
            assert isinstance(name, str)
            wanted = request_of(asked, self._directory)
            check_request(name, wanted)
            return self._jobs.start(task.order(wanted)).id

        return _json({"job": await self._board.elsewhere(job)})

    async def result(self, request: Request) -> Response:
        """A file of a result: shown without scripts, or downloaded."""
        if self._board.access.role_of(request) is None:
            return RedirectResponse("/login", 303)
        task, name, file = (request.path_params[key] for key in ("task", "name", "file"))
        found = await self._board.elsewhere(self._results.file, task_named(task).folder, name, file)
        if found.shown_as is None:
            disposition = f"attachment; filename*=UTF-8''{quote(file, safe='')}"
            return Response(
                found.content, media_type="application/octet-stream", headers={"content-disposition": disposition}
            )
        return Response(found.content, media_type=found.shown_as, headers={"content-security-policy": _REPORT_POLICY})


def request_of(asked: Mapping[str, Any], directory: Path) -> TaskRequest:
    """What a page asks for, with runs of the directory; ServerError if it is something else."""
    runs, values, limits = asked.get("runs", []), asked.get("values", {}), asked.get("limits", [])
    name = asked.get("name", "")
    well_formed = (
        isinstance(name, str)
        and isinstance(runs, list)
        and all(isinstance(run, str) for run in runs)
        and _is_texts(values)
        and isinstance(limits, list)
        and all(map(_is_texts, limits))
    )
    if not well_formed:
        raise ServerError("request-malformed", "the request is not that of a form", Message("reload the page"))
    listed = set(runs_in(directory))  # a name from outside never becomes a path by itself
    if absent := [run for run in runs if run not in listed]:
        raise ServerError(
            "run-unknown", f"there is no run {absent[0][:80]!r}", Message("reload the page"), run=absent[0][:80]
        )
    return TaskRequest(directory, tuple(dict.fromkeys(runs)), name, values, tuple(limits))


def _is_texts(value: object) -> bool:
    return isinstance(value, dict) and all(isinstance(text, str) for text in (*value, *value.values()))


def _json(value: dict[str, Any]) -> Response:
    return Response(to_json(value), media_type="application/json")


def _unknown() -> Response:
    return JSONResponse(error_answer(Message("log in first")), 401)
