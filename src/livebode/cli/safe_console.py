"""A Rich console for text from files, sources and users."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from livebode.cli.frames import visible


class SafeConsole(Console):
    """A Rich console that makes control characters in text visible and passes its own control codes."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Render with control characters made visible."""
        return _made_visible(super().render(renderable, options))

    def render_str(self, text: str, **options: Any) -> Text:
        """Render a string; made visible before Rich measures it, so that columns are wide enough."""
        return super().render_str(visible(text), **options)

    def on_broken_pipe(self) -> None:
        """Raise, so that `main` handles it; Rich would exit with 1."""
        raise BrokenPipeError


def _made_visible(segments: Iterable[Segment]) -> Iterator[Segment]:
    for segment in segments:
        yield segment if segment.control else Segment(visible(segment.text), segment.style)
