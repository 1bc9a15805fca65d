"""Dashboard: the server in a thread of its own."""

from __future__ import annotations

import asyncio
import logging
import socket
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from livebode.core import RecordError, ServerError, not_installed
from livebode.dashboard.access import Access
from livebode.dashboard.hub import Hub
from livebode.dashboard.listening_socket import listening
from livebode.dashboard.matrix_group import MatrixGroup, MatrixHub
from livebode.dashboard.run_feed import RunFeed, views_of
from livebode.dashboard.server_settings import ServerSettings
from livebode.dashboard.state import State

if TYPE_CHECKING:
    from livebode.dashboard.plugin_pages import PluginPages, WorkspacePages

HEADER_BYTES_MAX = 16 << 10
_START_S = 30.0
_END_S = 2
_logger = logging.getLogger(__name__)


class Dashboard:
    """Serves the page of one or several axes while it is used as a context manager.

    Parameters
    ----------
    serving
        Address, tokens and TLS.
    report
        Called with messages about the server, such as a wrong token.

    Raises
    ------
    ServerError
        On entering, if the server cannot listen on the address.
    ExtraError
        On entering, if the packages of the extra `dashboard` are missing.
    """

    def __init__(self, serving: ServerSettings, report: Callable[[str], None] = lambda _: None) -> None:
        self._serving, self._hears = serving, report
        self._states: list[State] = []
        self._viewed: dict[int, RunFeed] = {}
        self._hubs: dict[str, Hub | MatrixHub] = {}
        self._runs: Path | None = None
        self._others: PluginPages | None = None
        self._workspaces: dict[str, WorkspacePages] = {}
        self._server: Any = None
        self._thread: threading.Thread | None = None
        self._socket: socket.socket | None = None

    def hub(self, name: str, entries: Sequence[tuple[str, str]] = ()) -> Hub | MatrixHub:
        """The audience for the runs of the axis of this name; each entry of a matrix of responses is an axis.

        An open page shows an axis that is added later only after it is reloaded.
        """
        if name not in self._hubs:
            self._hubs[name] = self._of_matrix(name, entries) if entries else self._of_axis(name)
        return self._hubs[name]

    def _of_axis(self, name: str) -> Hub:
        hub = Hub(name)
        self._states.append(State(name, len(self._states), hub))
        return hub

    def _of_matrix(self, name: str, entries: Sequence[tuple[str, str]]) -> MatrixHub:
        """Hub of a matrix run, whose entries are in order, output by output."""
        hub = MatrixHub(name, list(entries))
        outputs, inputs = (tuple(dict.fromkeys(entry[k] for entry in entries)) for k in (0, 1))
        group = MatrixGroup(name, outputs, inputs, len(self._states), hub.newest)
        for (output, input), entry_hub in hub.hubs.items():
            state = State(entry_hub.name, len(self._states), entry_hub)
            state.group, state.entry = group, f"{output}/{input}"
            self._states.append(state)
        return hub

    def view(self, directory: Path) -> None:
        """Show a run that was recorded, or that another process records; LivebodeError if it cannot be read."""
        for state, viewed in views_of(directory, len(self._states)):
            self._viewed[state.axis] = viewed
            self._states.append(state)

    def view_all(self, directory: Path) -> None:
        """Show the list of all runs in a directory, instead of axes; each run is read when its page is opened.

        Pages of plug-ins that work in a directory are beside the list; with them it may be empty or missing.

        Raises
        ------
        RecordError
            If it contains no run, and no plug-in has pages that make one.
        """
        from livebode.dashboard.plugin_pages import workspace_pages
        from livebode.dashboard.run_catalogue import runs_in

        self._workspaces = workspace_pages(directory)
        if not self._workspaces and not runs_in(directory):
            raise RecordError(
                "not-a-run",
                f"{str(directory)!r} is not the directory of a run: it has no run.json, and no directory in it has one",
                "give the directory of a run, or a directory that contains runs",
                path=str(directory),
            )
        self._runs = directory

    def show(self, pages: PluginPages) -> None:
        """Show the pages of a plug-in, instead of axes."""
        self._others = pages

    @property
    def url(self) -> str:
        """The address of the page."""
        assert self._socket is not None
        host, port = self._socket.getsockname()[:2]
        host = {"0.0.0.0": socket.gethostname(), "::": socket.gethostname()}.get(host, host)
        return f"{'https' if self._serving.tls else 'http'}://{f'[{host}]' if ':' in host else host}:{port}/"

    @property
    def cpu_s(self) -> float:
        """Processor time of the server's thread, s."""
        assert self._thread is not None
        assert self._thread.ident is not None
        return time.clock_gettime(time.pthread_getcpuclockid(self._thread.ident))

    def __enter__(self) -> Self:
        try:
            import uvicorn

            from livebode.dashboard.listener import IDLE_S, PatientProtocol
            from livebode.dashboard.server import Server, WebSocketProtocol
        except ImportError as error:
            raise not_installed(
                f"the dashboard needs {error.name}, which is not installed",
                extra="dashboard",
                package=error.name or "uvicorn",
            ) from None
        self._socket = listening(self._serving)
        tls = self._serving.tls or (None, None)
        config = uvicorn.Config(
            self._serve,
            loop="asyncio",
            interface="asgi3",
            http=PatientProtocol,
            ws=WebSocketProtocol,
            lifespan="off",
            log_config=None,
            access_log=False,
            server_header=False,
            proxy_headers=False,
            ws_max_size=2048,
            ws_max_queue=8,
            ws_per_message_deflate=False,
            h11_max_incomplete_event_size=HEADER_BYTES_MAX,
            timeout_keep_alive=int(IDLE_S),
            timeout_graceful_shutdown=_END_S,
            ssl_certfile=tls[0],
            ssl_keyfile=tls[1],
        )
        # Requests of strangers are not logged; Faults reports internal errors without a traceback for each.
        logging.getLogger("uvicorn").setLevel(logging.CRITICAL)
        logging.getLogger("uvicorn.error").setLevel(logging.CRITICAL)
        self._server = Server(config, self._socket, self._report)
        self._thread = threading.Thread(target=self._run, name="livebode dashboard", daemon=True)
        self._thread.start()
        until = time.monotonic() + _START_S
        while not self._server.started:
            if not self._thread.is_alive() or time.monotonic() > until:
                raise ServerError(
                    "not-started",
                    f"the dashboard did not start at {self.url}",
                    "look for the reason in the lines above, and try another port",
                    url=self.url,
                )
            time.sleep(0.005)
        _logger.info("listening at %s", self.url)
        return self

    def __exit__(self, *_: object) -> None:
        assert self._thread is not None
        assert self._socket is not None
        self._server.should_exit = True
        self._thread.join(_END_S + 8)
        self._socket.close()
        _logger.info("stopped")

    def _report(self, sentence: str) -> None:
        """Log what a person should know, and tell it; what comes here is limited in its rate."""
        _logger.warning("%s", sentence)
        self._hears(sentence)

    def _run(self) -> None:
        # The default loop of Windows cannot wait for a socket that is not its own.
        with asyncio.Runner(loop_factory=asyncio.SelectorEventLoop) as runner:
            runner.run(self._work())

    async def _work(self) -> None:
        from livebode.dashboard.app import application
        from livebode.dashboard.board import Board
        from livebode.dashboard.server import Faults

        self._faults = Faults(self._report)
        asyncio.get_running_loop().set_exception_handler(self._faults.handler)
        board = Board(self._states, self._viewed, Access(self._serving, self._report))
        self._application = application(board, self._serving, self._runs, self._others, self._workspaces)
        shown = board if self._others is None else self._others
        beating = [asyncio.create_task(part.run()) for part in (shown, *self._workspaces.values())]
        for task in beating:
            task.add_done_callback(self._stopped)
        try:
            await self._server.serve()
        finally:
            for task in beating:
                task.cancel()
            await asyncio.gather(*beating, return_exceptions=True)
            board.close()

    def _stopped(self, task: asyncio.Task[None]) -> None:
        if not task.cancelled() and (error := task.exception()) is not None:
            self._report(f"the dashboard stopped: internal error ({error!r}); the run continues")

    async def _serve(self, scope: Any, receive: Any, send: Any) -> None:
        try:
            await self._application(scope, receive, send)
        except Exception as error:
            self._faults.report(error)
