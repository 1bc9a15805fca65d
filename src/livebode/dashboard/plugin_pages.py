"""What plug-ins show: pages instead of axes, and parts of the page of a run."""

from __future__ import annotations

import warnings
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from livebode.plugins import PluginWarning, loaded, named, not_loaded

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.routing import BaseRoute

    from livebode.dashboard.board import Board
    from livebode.dashboard.matrix_group import MatrixGroup
    from livebode.dashboard.past import Past
    from livebode.dashboard.quantities import Quantities

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


class ShownRun(NamedTuple):
    """The run of an axis of the page.

    Attributes
    ----------
    axis
        The axis.
    past
        Its record.
    quantities
        Its quantities.
    summary
        The run.json that it has or will have.
    group
        The matrix run of which it is an entry; None of any other run.
    units
        Units of the entries of the group, by output and input.
    """

    axis: int
    past: Past
    quantities: Quantities
    summary: dict[str, Any]
    group: MatrixGroup | None
    units: list[list[str]]


Answer = Callable[[ShownRun, Mapping[str, str]], dict[str, Any]]
"""Plain data for the page, from run and parameters of the request; called in the reading thread of the board."""


class PageAddition(Protocol):
    """What a plug-in adds to the page of a run; constructed without arguments, for each board.

    Attributes
    ----------
    static
        Directory of scripts and styles, which are served beside those of the page; the page has all its styles.
    script
        File there that exports `addition`, an `Addition` of messages.d.ts.
    """

    static: Path
    script: str

    def answers(self) -> Mapping[str, Answer]:
        """The answers by name: `GET /api/NAME?axis=0`."""


def page_additions() -> dict[str, type[PageAddition]]:
    """The additions of all plug-ins by name; one that cannot be loaded is left out with a PluginWarning."""
    additions: dict[str, type[PageAddition]] = {}
    for name, reference in named("pages").items():
        try:
            additions[name] = loaded(reference)
        except Exception as error:  # whatever the module of somebody else does: the page is needed without it, too
            why = f"{reference} {not_loaded(error)}; update its plug-in, or remove it"
            warnings.warn(f"{name!r} is not on the page: {why}", PluginWarning, stacklevel=2)
    return additions


def files_of_additions() -> dict[str, bytes]:
    """Static files of the additions, with the script that names them to the page, and their styles as one file."""
    additions = page_additions()
    files = {path.name: path.read_bytes() for page in additions.values() for path in sorted(page.static.iterdir())}
    imports = [f'import {{ addition as {name} }} from "./{page.script}";' for name, page in additions.items()]
    script = "\n".join([*imports, f"export const ADDITIONS = {{ {', '.join(additions)} }};", ""])
    styles = b"".join(content for name, content in files.items() if name.endswith(".css"))
    return files | {"additions.js": script.encode(), "additions.css": styles}
