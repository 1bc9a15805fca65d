"""The reader gives the numbers that were written."""

from pathlib import Path

import numpy as np
from livebode_trace.reader import TraceRecording


def test_the_numbers_of_a_trace_come_back(tmp_path: Path) -> None:
    values = np.random.default_rng(1).normal(size=(1000, 2))
    path = tmp_path / "axis.trace"
    np.savetxt(path, values, header="TRACE1 4000 u[Nm] y[rad/s]", comments="")
    trace = TraceRecording(path)
    assert trace.rate_hz == 4000
    assert [(column.name, column.unit) for column in trace.columns] == [("u", "Nm"), ("y", "rad/s")]
    chunks = list(trace.chunks(trace.columns, 300))
    np.testing.assert_array_equal(np.concatenate([np.stack(chunk) for chunk in chunks], axis=1), values.T)
