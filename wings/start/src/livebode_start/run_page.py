"""What the page of a run gets: a button that ends a measurement which was started in the browser."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from livebode.dashboard import Answer


class FinishButton:
    """Ends the job that records the shown run, as Ctrl-C would; hidden beside any other run."""

    static, script = Path(__file__).parent / "static", "finish.js"

    def answers(self) -> Mapping[str, Answer]:
        """Without any: it asks for the jobs of the directory."""
        return {}
