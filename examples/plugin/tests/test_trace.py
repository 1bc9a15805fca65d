"""The reader gives the numbers that were written."""

from pathlib import Path

import numpy as np
import pytest
from livebode_trace.reader import TraceRecording

from livebode import RecordingError


def test_the_numbers_of_a_trace_come_back(tmp_path: Path) -> None:
    values = np.random.default_rng(1).normal(size=(1000, 2))
    path = tmp_path / "axis.trace"
    np.savetxt(path, values, header="TRACE1 4000 u[Nm] y[rad/s]", comments="")
    trace = TraceRecording(path)
    assert trace.rate_hz == 4000
    assert [(column.name, column.unit) for column in trace.columns] == [("u", "Nm"), ("y", "rad/s")]
    chunks = list(trace.chunks(trace.columns, 300))
    np.testing.assert_array_equal(np.concatenate([np.stack(chunk) for chunk in chunks], axis=1), values.T)


@pytest.mark.parametrize("first", ["", "u y", "TRACE1", "TRACE1 fast u y"])
def test_a_first_line_of_another_form_is_refused_by_one_sentence(first: str, tmp_path: Path) -> None:
    path = tmp_path / "axis.trace"
    path.write_text(f"{first}\n1 2\n")
    with pytest.raises(RecordingError, match=r"axis\.trace"):
        TraceRecording(path)
