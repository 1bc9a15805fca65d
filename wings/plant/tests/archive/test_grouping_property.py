"""Groups of recordings: each recording once, and times that suit the number of workers."""

from __future__ import annotations

from dataclasses import dataclass

from hypothesis import given, settings
from hypothesis import strategies as st

from livebode_plant.archive.distribution import RecordingGroups


@dataclass(frozen=True)
class Item:
    size_bytes: int


SIZES = st.lists(st.integers(0, 10**9), max_size=200)


@settings(max_examples=40)
@given(SIZES, st.integers(1, 20), st.floats(0, 1e-5))
def test_each_item_is_in_one_group_and_in_order(sizes: list[int], workers: int, s_per_byte: float) -> None:
    items = [Item(size) for size in sizes]
    groups, found = RecordingGroups(items), []
    while len(groups):
        group = groups.next(workers)
        assert group
        for item in group:
            groups.learn(item.size_bytes, item.size_bytes * s_per_byte)
        found += group
    assert found == items


@settings(max_examples=40)
@given(st.integers(1, 8), st.integers(40, 400), st.floats(0.001, 2.0))
def test_a_worker_has_four_groups_or_groups_are_as_short_as_their_overhead_allows(
    workers: int, count: int, seconds: float
) -> None:
    items = [Item(1000)] * count
    groups, lengths = RecordingGroups(items), []
    while len(groups):
        group = groups.next(workers)
        groups.learn(sum(item.size_bytes for item in group), seconds * len(group))
        lengths.append(len(group))
    longest_s = max(lengths) * seconds
    assert len(lengths) >= 4 * workers or longest_s <= 0.2 + seconds
    assert longest_s <= 10.0 + seconds
