"""Models that are built at their first use: in many threads at the same moment, as axes and requests are threads."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from pydantic import BaseModel, create_model

from livebode.configuration import Axis
from livebode.records.summary_shape import _AnySummary
from livebode.sources.live import SourceSettings

THREADS, TIMES = 8, 20
SOURCE = {"url": "tcp://127.0.0.1:1", "nodes": {"y": "ns=2;s=y"}}
SUMMARY = {"counts": {"samples": 3}, "configuration": {"source": {"url": "tcp://127.0.0.1:1"}}}
AXIS = {"signals": {"input": "u", "output": "y"}, "source": {"url": "tcp://127.0.0.1:1"}}


@pytest.mark.parametrize(("model", "given"), [(SourceSettings, SOURCE), (_AnySummary, SUMMARY), (Axis, AXIS)])
def test_a_model_whose_first_use_is_in_many_threads_is_whole_in_each(model: type[BaseModel], given: dict) -> None:
    """Pydantic 2.11.0 … 2.11.4 give the parent of the model to whoever comes second."""
    expected = model.model_validate(given).model_dump(mode="json")

    def use(again: type[BaseModel], together: threading.Barrier) -> Any:
        together.wait()
        return again.model_validate(given).model_dump(mode="json")

    with ThreadPoolExecutor(THREADS) as pool:
        for _ in range(TIMES):
            again = create_model("Again", __base__=model, more=(int, 0))
            together = threading.Barrier(THREADS)
            found = list(pool.map(use, [again] * THREADS, [together] * THREADS))
            assert found == [expected | {"more": 0}] * THREADS
