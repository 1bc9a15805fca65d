"""Tables that pydantic has to decide about for the first time: in many threads, as axes and requests are threads."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from livebode.configuration import Axis
from livebode.core import TypedTable
from livebode.records.summary_shape import _AnySummary
from livebode.sources.live import SourceSettings

THREADS, TIMES = 8, 20


class Text(str):
    """A text that is not plain, so that pydantic decides."""

    __slots__ = ()


URL = Text("tcp://127.0.0.1:1")
SOURCE = {"url": URL, "nodes": {"y": "ns=2;s=y"}}
SUMMARY = {"counts": {"samples": 3}, "recipe": Text("abc"), "configuration": {"source": {"url": "tcp://127.0.0.1:1"}}}
AXIS = {"signals": {"input": "u", "output": "y"}, "source": {"url": URL}}


@pytest.mark.parametrize(("table", "given"), [(SourceSettings, SOURCE), (_AnySummary, SUMMARY), (Axis, AXIS)])
def test_a_table_whose_first_use_is_in_many_threads_is_whole_in_each(table: type[TypedTable], given: dict) -> None:
    expected = table.model_validate(given).model_dump(mode="json")

    def use(again: type[TypedTable], together: threading.Barrier) -> Any:
        together.wait()
        return again.model_validate(given).model_dump(mode="json")

    with ThreadPoolExecutor(THREADS) as pool:
        for _ in range(TIMES):
            again = type("Again", (table,), {"__annotations__": {"more": "int"}, "more": 0, "__module__": __name__})
            together = threading.Barrier(THREADS)
            found = list(pool.map(use, [again] * THREADS, [together] * THREADS))
            assert found == [expected | {"more": 0}] * THREADS
