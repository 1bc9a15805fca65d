"""Row of the table of analyses that a plug-in declares."""

from __future__ import annotations

from typing import NamedTuple


class Analysis(NamedTuple):
    """An analysis of a run, and where its result is shown; each attribute is "module:name".

    Attributes
    ----------
    function
        Called with a `livebode.Run` and options.
    section
        Section of the report, from the file that the analysis left in the run directory. Called with the directory and,
        of a matrix run, the entry; returns a `Section`, or the reason why there is none. Empty: not in the report.
    trial
        Class whose objects answer the page where a person tries other gains (`livebode.dashboard.LoopTrialAnswers`).
    """

    function: str
    section: str = ""
    trial: str = ""
