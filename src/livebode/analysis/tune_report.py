"""A proposed controller for the loop of a finished run."""

from __future__ import annotations

import json
from pathlib import Path

from livebode.analysis.places import by_place
from livebode.configuration.axis import Axis
from livebode.configuration.loop_section import LoopSection
from livebode.configuration.recorded import recorded_configuration, without_null
from livebode.core import RecordError, Responses, TuneError
from livebode.records import RunRecord
from livebode.tuning import ControllerProposal, LoopSpecification, tune

AS_DESCRIBED = "as described"
LOOP_CHECK = "loop-check.json"
_CONTRADICTED = ("one change", "not explained")


def tune_run(
    directory: Path, specification: LoopSpecification, axis: Axis | None = None, *, loop_checked: bool = False
) -> ControllerProposal:
    """The proposal for a run; the loop is from `axis`, else from its configuration.

    The responses are the mean of the run, or with a schedule the means at twelve places.

    Parameters
    ----------
    directory
        Run directory.
    specification
        Limits.
    axis
        Another description of the loop.
    loop_checked
        The description was verified otherwise; else the run's directory must contain the verdict of a check.

    Raises
    ------
    TuneError
        If nothing can be proposed.
    UsageError
        If the loop's feedback is missing.
    """
    run = RunRecord.open(directory)
    section = axis.loop if axis is not None else None
    if section is None:
        section = LoopSection.model_validate(recorded_configuration(run.summary).get("loop", {}))
    responses = Responses.join(list(run.steady_batches()))
    checked = loop_checked or _checked(directory, section)
    return tune(by_place(responses), section.build(responses.lines.rate_hz), specification, loop_checked=checked)


def _checked(directory: Path, section: LoopSection) -> bool:
    """Whether the recording confirms this description of the loop; TuneError if it contradicts it."""
    path = directory / LOOP_CHECK
    if not path.is_file():
        return False
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        verdict, sentence, of = (
            found["verdict"],
            found["sentence"],
            LoopSection.model_validate(without_null(found["loop"])),
        )
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        raise RecordError(
            "unreadable",
            f"{str(path)!r} cannot be read: {error}",
            "check the loop again",
            path=str(path),
            reason=str(error),
        ) from None
    if of != section or verdict not in (AS_DESCRIBED, *_CONTRADICTED):
        return False
    if verdict in _CONTRADICTED:
        raise TuneError("loop-contradicted", str(sentence), "correct [loop], and check it again", key="loop")
    return True
