"""What plug-ins show: pages instead of axes, pages beside the list of runs, and parts of the page of a run."""

from __future__ import annotations

import warnings
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol

from livebode.plugins import PluginWarning, loaded, named, not_loaded

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.routing import BaseRoute

    from livebode.dashboard.board import Board
    from livebode.dashboard.matrix_group import MatrixGroup
    from livebode.dashboard.past import Past
    from livebode.dashboard.quantities import Quantities


class Order(Protocol):
    """Reads the JSON of an operator."""

    def __call__(self, request: Request, bytes_max: int = ...) -> Awaitable[bytes | Response]:
        """The JSON, of at most so many bytes, or the answer to somebody else."""


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


class WorkspacePages(PluginPages, Protocol):
    """Pages that work in a directory of runs, beside their list; constructed with this directory, which may be missing.

    Attributes
    ----------
    script
        File in `static` that exports `workspace`, a `Workspace` of messages.d.ts, which the list of runs loads.
    """

    script: str


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
    return _classes("pages")


def workspace_pages(directory: Path) -> dict[str, WorkspacePages]:
    """The pages of all plug-ins that work in this directory, by name; left out as above."""
    return {name: pages(directory) for name, pages in _classes("workspaces").items()}


def _classes(group: Literal["pages", "workspaces"]) -> dict[str, Any]:
    classes: dict[str, Any] = {}
    for name, reference in named(group).items():
        try:
            classes[name] = loaded(reference)
        except Exception as error:  # whatever the module of somebody else does: the page is needed without it, too
            why = f"{reference} {not_loaded(error)}; update its plug-in, or remove it"
            warnings.warn(f"{name!r} is not on the page: {why}", PluginWarning, stacklevel=3)
    return classes


def files_of_additions(workspaces: Mapping[str, WorkspacePages]) -> dict[str, bytes]:
    """Static files of what plug-ins add, with the scripts that name it to the pages, and its styles as one file."""
    additions = page_additions()
    folders = [*(page.static for page in additions.values()), *(pages.static for pages in workspaces.values())]
    files = {path.name: path.read_bytes() for folder in folders for path in sorted(folder.iterdir())}
    styles = b"".join(content for name, content in files.items() if name.endswith(".css"))
    return files | {
        "additions.css": styles,
        "additions.js": _script("addition", "ADDITIONS", additions),
        "workspaces.js": _script("workspace", "WORKSPACES", workspaces),
    }


def _script(part: str, table: str, scripts: Mapping[str, Any]) -> bytes:
    """A module that exports a table of what each script exports as `part`."""
    imports = [f'import {{ {part} as {name} }} from "./{parts.script}";' for name, parts in scripts.items()]
    return "\n".join([*imports, f"export const {table} = {{ {', '.join(scripts)} }};", ""]).encode()
