"""Batches out of order."""

from __future__ import annotations

from hypothesis import strategies as st

from livebode.sources.live import Batch


def displaced(batches: list[Batch], bound: int, draw: st.DataObject) -> list[Batch]:
    """An order in which no batch is more than `bound` places late."""
    left, order = list(range(len(batches))), []
    for place in range(len(batches)):
        due = [i for i in left if place - i >= bound]
        pick = due[0] if due else left[draw.draw(st.integers(0, min(bound, len(left) - 1)))]
        left.remove(pick)
        order.append(pick)
    assert max(order.index(i) - i for i in range(len(batches))) <= bound
    return [batches[i] for i in order]
