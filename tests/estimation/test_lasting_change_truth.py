"""A change of the machine is reported during the run, with its line, its size and its time; noise is not."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from livebode.core import Event, Lines
from livebode.estimation import LastingChange

LINES = Lines.parse("20:140:10", 4000, 400)
NOISE = 0.02  # of the response, in a window
OF_AVERAGE = NOISE / 3  # sigma of an average over nine periods
Rows = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def windows(seed: int, count: int, changed: float = 0.0, lines: int = len(LINES), at: int = 0) -> Rows:
    """Numerator and denominator, time, schedule, sample; the response of some lines is larger from window `at` on."""
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal((2, count, len(LINES))) * NOISE / np.sqrt(2)
    value = 2 + 2 * (noise[0] + 1j * noise[1])
    value[at:, :lines] *= 1 + changed
    input_ = np.full_like(value, 3j)
    number = np.arange(count)
    return np.stack([value * input_, input_]), number * 0.1, np.full(count, np.nan), number * 400 + 399


def events_of(rows: Rows) -> list[Event]:
    events: list[Event] = []
    LastingChange(LINES, events).process(*rows)
    return events


def test_a_run_at_rest_is_not_reported() -> None:
    """20 runs of ten minutes; at 0.5 %, more than one has a probability of 0.5 %."""
    assert sum(bool(events_of(windows(seed, 6000))) for seed in range(20)) <= 1


@pytest.mark.parametrize(("lines", "sigmas"), [(len(LINES), 2.0), (1, 4.0)])
def test_a_step_is_reported_with_its_time_and_its_size(lines: int, sigmas: float) -> None:
    """Two sigma of the average at all lines, or four at one, in the middle of two minutes."""
    change = sigmas * OF_AVERAGE
    for seed in range(10):
        event = events_of(windows(seed, 1200, change, lines, 600))[0]
        facts = event.details
        assert event.kind == "response-changes"
        assert facts["since_s"] == pytest.approx(60, abs=6)
        assert abs(facts["percent"] - 100 * change) < 2 * facts["bound_percent"]


def test_where_the_schedule_moves_nothing_is_reported() -> None:
    pair, time_s, _, sample = windows(0, 600, 0.5, at=300)
    assert not events_of((pair, time_s, 1 + 0.01 * np.sin(time_s), sample))


def test_any_division_of_the_windows_and_a_restored_test_report_the_same() -> None:
    rows = windows(5, 900, 0.05, at=500)
    expected = events_of(rows)
    assert len(expected) == 1
    for edges in ([0, 3, 9, 25, 26, 300, 301, 545, 900], list(range(901))):
        events: list[Event] = []
        test = LastingChange(LINES, events)
        for first, last in pairwise(edges):
            snapshot, test = test.snapshot(), LastingChange(LINES, events)
            test.restore(snapshot)
            now = slice(first, last)
            test.process(rows[0][:, now], *(part[now] for part in rows[1:]))
        assert events == expected
