"""What plug-ins add to the page: pages instead of axes, and answers to trials of gains and filters."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from livebode.analysis import first_analysis
from livebode.core import ServerError
from livebode.dashboard.past import Past
from livebode.dashboard.quantities import Quantities

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.routing import BaseRoute

    from livebode.dashboard.board import Board

Order = Callable[["Request"], Awaitable["bytes | Response"]]


class PluginPages(Protocol):
    """Pages of a plug-in, with the login, the access control and the limits of the dashboard."""

    @property
    def static(self) -> Path:
        """Directory of their scripts, styles and HTML, which are served beside those of the dashboard."""

    def routes(self, board: Board, file: Callable[[str], Response], order: Order) -> list[BaseRoute]:
        """The routes.

        Parameters
        ----------
        board
            Without axes: access control and places.
        file
            Answers with a static file.
        order
            The JSON of an operator, or the answer to somebody else.
        """

    async def run(self) -> None:
        """Update what the pages show until it is cancelled, in the thread of the server."""


_MISSING, _REMEDY = "the wing control is not installed", "install this wing too"


class LoopTrialAnswers(Protocol):
    """The trials of one board; used in its reading thread."""

    def facts(self, axis: int, past: Past, quantities: Quantities, summary: dict[str, Any]) -> dict[str, Any]:
        """What the page needs to compute the loop with other gains and filters; `why_not` if nothing can be tried."""

    def steps(self, axis: int, past: Past, quantities: Quantities, text: str) -> dict[str, Any]:
        """Steps and torque noise before and after, with the gains and filters of the text of the page."""


class NoTrials:
    """Trials of an installation that has none."""

    def facts(self, *_: object) -> dict[str, Any]:
        """The reason."""
        return {"why_not": f"{_MISSING}; {_REMEDY}"}

    def steps(self, *_: object) -> dict[str, Any]:
        """ServerError with the reason."""
        raise ServerError("quantity-unavailable", _MISSING, _REMEDY)


def loop_trials() -> LoopTrialAnswers:
    """Answers of the first analysis that has some."""
    trials = first_analysis("trial") or NoTrials
    answers: LoopTrialAnswers = trials()
    return answers
