"""The thinned copy of a run is evenly spread, bounded, and made of rows that the run has."""

from __future__ import annotations

import gc
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.analysis import Overview
from livebode.core import Lines, Responses

LINES = Lines((4,), 100, 1000.0)


def batch(first: int, rows: int) -> Responses:
    number = np.arange(first, first + rows)
    column = number[:, np.newaxis].astype(float)
    return Responses(
        LINES, column + 0j, column, number * 1.0, column, column > 0, number, number, number * 1.0, number * 1.0
    )


@settings(max_examples=50, deadline=None)
@given(sizes=st.lists(st.integers(0, 9000), min_size=1, max_size=12))
def test_an_overview_retains_every_nth_row(sizes: list[int]) -> None:
    overview, first = Overview(), 0
    for size in sizes:
        overview.add(batch(first, size))
        first += size
    kept = overview.responses()
    assert len(kept) <= 2048
    stride = kept.sample[1] - kept.sample[0] if len(kept) > 1 else 1
    assert np.array_equal(kept.sample, np.arange(0, first, stride))
    assert first == 0 or len(kept) > min(first, 2048) // 2
    assert np.array_equal(kept.value[:, 0].real, kept.sample)


def test_an_overview_with_a_limit_of_values_has_fewer_rows_of_the_same_run() -> None:
    limited, whole = Overview(300), Overview()
    for first in range(0, 2000, 10):
        limited.add(batch(first, 10))
        whole.add(batch(first, 10))
    kept = limited.responses()
    assert 150 < len(kept) <= 300
    assert kept.equals(whole.responses()[:: kept.sample[1]])


@pytest.mark.parametrize("rows", [0, 1, 5])
def test_memory_of_an_overview_does_not_grow_with_the_batches(rows: int) -> None:
    overview, first = Overview(), 0
    tracemalloc.start()
    held = []
    for _ in range(2):
        for _ in range(3_000):
            overview.add(batch(first, rows))
            first += rows
        gc.collect()
        held.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    # Twice the rows of which at most 2,048 are held, at some 130 bytes; one empty part a batch costs 2 kB each.
    assert held[1] - held[0] < 2048 * 200
