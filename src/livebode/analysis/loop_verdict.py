"""What the newest check of a run's loop found, read without the packages that a check needs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from livebode.configuration import LoopSection, without_null
from livebode.records import read_loop_check


@dataclass(frozen=True)
class CheckedLoop:
    """Whether the description of a loop was checked, in short.

    Attributes
    ----------
    verdict
        "as described", "one change", "not explained", or "not checked".
    sentence
        The result, or why there is none.
    """

    verdict: str
    sentence: str


NOT_CHECKED = CheckedLoop("not checked", "loop not checked: its description was not compared with the signals")
CHANGED = CheckedLoop("not checked", "loop not checked: another description was compared with the signals")


def checked_loop(directory: Path, section: LoopSection, entry: tuple[str, str] | None = None) -> CheckedLoop:
    """What is known of this description of a run's loop: the newest check, if it was of the same description.

    With the output and the input of an `entry` of a matrix run, `section` describes its controller alone.
    """
    stored = read_loop_check(directory)
    if stored is None:
        return NOT_CHECKED
    try:
        of = LoopSection.model_validate(without_null(stored["loop"]))
        if entry is not None:
            of, stored = of.of_controller(*entry), stored["controllers"]["/".join(entry)]
    except (ValidationError, AttributeError, KeyError, TypeError):
        return CHANGED
    return CheckedLoop(str(stored.get("verdict")), str(stored["sentence"])) if of == section else CHANGED
