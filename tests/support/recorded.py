"""A small machine that is recorded in segments, and what its record must hold."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path

import numpy as np

from livebode.configuration import RecordSection
from livebode.core import Block, Channel, Event, Responses
from livebode.estimation import Settings, Tracker
from livebode.records import RunRecord, each_event
from livebode.runtime import Document, Outcome, TrackerResults
from tests.support.command import LINES, RATE_HZ, signals
from tests.support.found import with_events
from tests.support.runs import record

NAMES = ("w", "u", "y", "t")
SETTINGS = Settings(lines=LINES, output="y", input="u", excitation="w", schedule="t", hop=5, spikes=("u",))
KEPT = RecordSection(samples=True, segment_s=1.0)
OWN = "record-"
"""How the kinds of events begin that the record says of itself."""


@cache
def data(samples: int) -> np.ndarray:
    """w, u, y, t with a sample that is not finite and a spike, shape (4, samples)."""
    columns = signals(samples)
    columns["y"][samples // 3] = np.nan
    columns["u"][samples // 2] = 40.0
    return np.array([columns[name] for name in NAMES])


@dataclass(frozen=True)
class Machine:
    """The same samples each time, numbered from `first` on; `samples` says what the source knows of its end."""

    data: np.ndarray
    samples: int | None = None
    block_samples: int = 170
    each: Callable[[int], None] = lambda _: None
    first: int = 0

    @property
    def channels(self) -> tuple[Channel, ...]:
        return tuple(Channel(name) for name in NAMES)

    def blocks(self, channels: Sequence[str]) -> Iterator[Block]:
        rows = [NAMES.index(name) for name in channels]
        for start in range(0, self.data.shape[1], self.block_samples):
            self.each(start)
            piece = self.data[rows, start : start + self.block_samples]
            yield Block(piece, tuple(channels), RATE_HZ, start=self.first + start)


def machine(samples: int, each: Callable[[int], None] = lambda _: None) -> Machine:
    return Machine(data(samples), samples, each=each)


def record_machine(
    source: Machine,
    directory: Path,
    *,
    kept: RecordSection = KEPT,
    progress: Callable[[int, int | None], None] = lambda *_: None,
    report: Callable[[Event], None] = lambda _: None,
    again: bool = True,
) -> Outcome:
    """Record the machine until its end, from where its record ends."""

    def listen(document: Document) -> None:
        if isinstance(document, TrackerResults):
            progress(document.samples, document.samples_total)
        elif isinstance(document, Event) and document.kind.startswith("record-"):
            report(document)

    about = {"configuration": {"record": kept.model_dump()}}
    return record(source, Tracker(SETTINGS), directory, about=about, segments=kept, again=again, subscribers=[listen])


@cache
def expected(samples: int) -> tuple[Responses, tuple[Event, ...]]:
    """What an uninterrupted tracker makes of it, without any record."""
    responses, events = with_events(Tracker(SETTINGS).process, Block(data(samples), NAMES, RATE_HZ))
    return responses, tuple(events)


def same(found: Responses, expected: Responses) -> bool:
    """Bit for bit."""
    pairs = [(getattr(found, field.name), getattr(expected, field.name)) for field in fields(found)]
    return all(_bits(a) == _bits(b) for a, b in pairs)


def _bits(value: object) -> object:
    return (value.dtype, value.shape, value.tobytes()) if isinstance(value, np.ndarray) else value


def check_beginning(directory: Path, samples: int, sample_min: int) -> int:
    """That the record is the beginning of an uninterrupted one, with nothing lost before `sample_min`.

    Returns how many samples it holds.
    """
    run, (responses, events) = RunRecord.open(directory), expected(samples)
    found = run.responses()
    assert same(found, responses[: len(found)])
    kept = [table["sample"] for table in run.tables("samples")]
    number = np.concatenate(kept) if kept else np.zeros(0, dtype=np.int64)
    assert np.array_equal(number, np.arange(number.size))
    assert number.size >= sample_min
    due = int(np.count_nonzero(responses.sample < number.size))
    assert len(found) == due
    reported = [one for event in run.events() if not event.kind.startswith(OWN) for one in each_event(event)]
    # An event is written before the rows that belong to it are committed.
    assert reported == list(events[: len(reported)])
    assert len(reported) >= sum(event.sample < number.size for event in events)
    return number.size


def check_whole(directory: Path, samples: int) -> None:
    """That a finished record equals that of an uninterrupted run."""
    assert check_beginning(directory, samples, samples) == samples
    run = RunRecord.open(directory)
    assert run.finished
    tables = list(run.tables("samples"))
    for name, values in zip(NAMES, data(samples)):
        assert np.array_equal(np.concatenate([table[name] for table in tables]), values, equal_nan=True), name
    counts = run.summary["counts"]
    responses = expected(samples)[0]
    assert (counts["samples"], counts["responses"], counts["gaps"]) == (samples, len(responses), 0)
    assert counts["invalid_responses"] == np.count_nonzero(~responses.valid.all(axis=1))


def unfinished(directory: Path) -> bool:
    return not (directory / "run.json").exists() or not RunRecord.open(directory).finished
