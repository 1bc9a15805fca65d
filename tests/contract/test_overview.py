"""The thinned copy of a run is evenly spread, bounded, and made of rows that the run has."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.nouns import Lines, Responses
from livebode.session.overview import Overview

LINES = Lines((4,), 100, 1000.0)


def batch(first: int, rows: int) -> Responses:
    number = np.arange(first, first + rows)
    column = number[:, np.newaxis].astype(float)
    return Responses(
        LINES, column + 0j, column, number * 1.0, column, column > 0, number, number, number * 1.0, number * 1.0
    )


@settings(max_examples=50, deadline=None)
@given(sizes=st.lists(st.integers(0, 9000), min_size=1, max_size=12))
def test_it_keeps_every_nth_row(sizes: list[int]) -> None:
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
