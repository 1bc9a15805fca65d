"""A recorded run as axes of the page: one, or one for each entry of a matrix run."""

from __future__ import annotations

from pathlib import Path

from livebode.dashboard.matrix_group import MatrixGroup
from livebode.dashboard.run_feed import RunFeed
from livebode.dashboard.state import State
from livebode.estimates import kind_of, rule
from livebode.records import RunRecord, read_summary


def views_of(directory: Path, first_axis: int = 0) -> list[tuple[State, RunFeed]]:
    """The states of a run with all its data; LivebodeError if it cannot be read."""
    summary, _ = read_summary(directory)
    page = rule(kind_of(summary), "page") or views_of_response  # which says why there is none
    return page(directory, directory.resolve().name, first_axis)


def views_of_response(directory: Path, name: str, first_axis: int) -> list[tuple[State, RunFeed]]:
    """The only axis of a run with single responses."""
    state, viewed = State(name, first_axis), RunFeed(directory)
    viewed.fill(state)
    return [(state, viewed)]


def views_of_matrix(directory: Path, name: str, first_axis: int) -> list[tuple[State, RunFeed]]:
    """All entries: of a long run from its means, else from one reading of the matrices."""
    run = RunRecord.open(directory, matrix=True)
    found = run.summary["found"]
    group = MatrixGroup(name, tuple(found["outputs"]), tuple(found["inputs"]), first_axis)
    views = []
    for number, (output, input) in enumerate(group.entries):
        entry = f"{output}/{input}"
        state, viewed = State(f"{name} {entry}", first_axis + number), RunFeed(directory, entry)
        state.group, state.entry = group, entry
        viewed.begin(state)
        views.append((state, viewed))
    if not all(viewed.fill_from_means(state) for state, viewed in views):
        for part in run.matrix_batches():
            for (state, viewed), (output, input) in zip(views, group.entries):
                viewed.pass_new(state, part.entry(output, input))
    for state, viewed in views:
        viewed.rest(state)
    return views
