"""Whether the configuration is valid, and the run can be read."""

from __future__ import annotations

from livebode.core import LivebodeError, counted
from livebode.doctor.check import Check
from livebode.doctor.subject import Subject

NAME, RUN = "configuration", "run"


def check_configuration(subject: Subject) -> Check:
    """Whether the file is valid."""
    if subject.configuration is None:
        return Check(NAME, "not applicable", "no configuration was given")
    if (error := subject.problems.get(NAME)) is not None:
        return Check.of_error(NAME, error)
    axes = "1 axis" if len(subject.axes) == 1 else f"{len(subject.axes)} axes"
    what = subject.kind.title if subject.kind is not None else axes
    facts = {"path": str(subject.configuration), "axes": list(subject.axes)}
    return Check(NAME, "ok", f"{subject.configuration} is valid: {what}", facts=facts)


def check_run(subject: Subject) -> Check:
    """Whether all that the run has recorded can be read."""
    if subject.run_path is None:
        return Check(RUN, "not applicable", "no run was given")
    run = subject.run
    if run is None:
        return Check.of_error(RUN, subject.problems[RUN])
    try:
        responses = sum(map(len, run.batches()))
        events = sum(1 for _ in run.each_event())
    except LivebodeError as error:
        return Check.of_error(RUN, error)
    state = "finished" if run.finished else "being recorded, or ended by a kill"
    message = f"{subject.run_path}: {state}; {counted(responses)}, {counted(events, 'event')}"
    facts = {"finished": run.finished, "responses": responses, "events": events, "damages": len(run.damages)}
    if run.damages:
        remedy = "what is damaged is left out, the rest is used; check the disk"
        return Check(RUN, "warning", f"{message}; {run.damages[0].message}", remedy, facts)
    return Check(RUN, "ok", message, facts=facts)
