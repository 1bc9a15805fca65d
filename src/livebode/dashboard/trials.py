"""What answers the page on which a person tries other gains and filters: a class that a plug-in adds to an analysis."""

from __future__ import annotations

from typing import Any, Protocol

from livebode.analysis import first_analysis
from livebode.core import ServerError
from livebode.dashboard.past import Past
from livebode.dashboard.quantities import Quantities

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
    """Those of the first analysis that has some."""
    trials = first_analysis("trial") or NoTrials
    found: LoopTrialAnswers = trials()
    return found
