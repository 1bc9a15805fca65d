"""Row of the table of analyses that a plug-in declares."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from livebode.analysis._loop_report import LoopReport
from livebode.core import Finding, Part, Section, UsageError
from livebode.language import tr
from livebode.plugins import loaded, named


class Analysis(NamedTuple):
    """An analysis of a run, and where its result is shown; each attribute is "module:name".

    Attributes
    ----------
    function
        Called with a `livebode.Run` and options.
    section
        Section of the report, from the file that the analysis left in the run directory. Called with the directory and,
        of a matrix run, the entry; returns a `Section`, or the reason why there is none. Empty: not in the report.
    filter
        Proposed filter for the loop of a run, for its run.json. Called with the `LoopReport`; returns data for JSON.
    loop
        Section of the report on the margins of the described loop. Called with the `LoopReport` and the parts that show
        the margins over time.
    test
        Test of the run's model on independent data, for `livebode report --on`. Called with the run directory and the
        recording; returns a `ModelTest`.
    """

    function: str
    section: str = ""
    filter: str = ""
    loop: str = ""
    test: str = ""


def first_analysis(attribute: str) -> Any:
    """What the first analysis that has this attribute names by it; None if none has it."""
    references = (getattr(analysis, attribute) for analysis in named("analyses").values())
    return next((loaded(reference) for reference in references if reference), None)


def proposed_filter(loop: LoopReport) -> dict[str, Any] | None:
    """The filter for a loop; None if no analysis proposes filters."""
    propose = first_analysis("filter")
    return None if propose is None else propose(loop)


def loop_section(loop: LoopReport, over_time: Sequence[Part]) -> Section | str:
    """The section of the report on the margins of a loop, or why there is none."""
    section = first_analysis("loop")
    return tr("No margins: the wing control is not installed.") if section is None else section(loop, over_time)


class ModelTest(Protocol):
    """Result of the test of a model on independent data, worded in the language in use."""

    def findings(self) -> Sequence[Finding]:
        """The findings of the report's first page."""

    def section(self) -> Section:
        """The section of the report."""


def model_test(directory: Path, on: Path) -> ModelTest:
    """The model of a run tested on another recording.

    Raises
    ------
    UsageError
        If no analysis tests models.
    """
    test = first_analysis("test")
    if test is None:
        raise UsageError(
            "missing",
            "a model is tested by the wing control, which is not installed",
            "install the wing control of livebode",
            argument="on",
        )
    result: ModelTest = test(directory, on)
    return result
