"""A recorded run as axes of the page: one, or one for each entry of a matrix run."""

from __future__ import annotations

from pathlib import Path

from livebode.dashboard.matrix_group import MatrixGroup
from livebode.dashboard.state import State
from livebode.dashboard.viewed import Viewed
from livebode.records import RunRecord
from livebode.records.matrix_run import is_matrix
from livebode.records.summary_file import read_summary


def views_of(directory: Path, first_axis: int = 0) -> list[tuple[State, Viewed]]:
    """The states of a run with all its data; LivebodeError if it cannot be read."""
    name = directory.resolve().name
    if is_matrix(read_summary(directory)[0]):
        return _of_matrix(directory, name, first_axis)
    state, viewed = State(name, first_axis), Viewed(directory)
    viewed.fill(state)
    return [(state, viewed)]


def _of_matrix(directory: Path, name: str, first_axis: int) -> list[tuple[State, Viewed]]:
    """All entries: of a long run from its means, else from one reading of the matrices."""
    run = RunRecord.open(directory, matrix=True)
    found = run.summary["found"]
    group = MatrixGroup(name, tuple(found["outputs"]), tuple(found["inputs"]), first_axis)
    views = []
    for number, (output, input) in enumerate(group.entries):
        entry = f"{output}/{input}"
        state, viewed = State(f"{name} {entry}", first_axis + number), Viewed(directory, entry)
        state.group, state.entry = group, entry
        viewed.begin(state)
        views.append((state, viewed))
    if not all(viewed.fill_from_means(state) for state, viewed in views):
        for part in run.matrix_batches():
            for (state, viewed), (output, input) in zip(views, group.entries):
                viewed.take(state, part.entry(output, input))
    for state, viewed in views:
        viewed.rest(state)
    return views
