"""NumPy to Arrow and back is what Arrow's own ways give, and a run gets by without pandas."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from livebode.tables import from_numpy, text, to_numpy
from tests.support.command import signals, write_parquet

NUMBERS = hnp.integer_dtypes(endianness="=") | hnp.unsigned_integer_dtypes(endianness="=") | hnp.floating_dtypes(
    endianness="=", sizes=(32, 64)
)  # fmt: skip
AXIS = """
[source]
log = "log.parquet"
[signals]
output = "y"
input = "u"
excitation = "w"
schedule = "t"
[lines]
frequencies = "50,100,200"
window = 100
[tracking]
hop = 50
[fit]
model = "two-mass"
output = "velocity"
radius_m = 0.019
"""


@settings(deadline=None)
@given(hnp.arrays(NUMBERS | hnp.boolean_dtypes(), st.integers(0, 70)), st.integers(1, 3))
def test_arrays_are_those_of_arrow(values: np.ndarray, step: int) -> None:
    found = from_numpy(values[::step])
    found.validate(full=True)
    assert found.equals(pa.array(values[::step])) or np.isnan(values.astype(float)).any()
    assert to_numpy(found).tobytes() == values[::step].tobytes()


@settings(deadline=None)
@given(st.data(), hnp.arrays(NUMBERS, st.integers(0, 70)))
def test_nulls_are_read_as_arrow_reads_them(data: st.DataObject, values: np.ndarray) -> None:
    null = data.draw(hnp.arrays(bool, values.shape))
    array = pa.array(values, mask=null)[data.draw(st.integers(0, 9)) :][: data.draw(st.integers(0, 70))]
    found, expected = to_numpy(array), array.to_numpy(zero_copy_only=False)
    assert (found.dtype, found.tobytes()) == (expected.dtype, expected.tobytes())


@settings(deadline=None)
@given(st.data(), st.lists(st.text(max_size=5), min_size=1, max_size=5))
def test_text_is_the_words_named(data: st.DataObject, words: list[str]) -> None:
    at = data.draw(st.lists(st.integers(0, len(words) - 1), max_size=20))
    found = text(words, np.array(at, dtype=np.int64))
    found.validate(full=True)
    assert found.equals(pa.array([words[i] for i in at], pa.string()))


def test_neither_a_run_nor_one_that_records_samples_imports_pandas(tmp_path: Path) -> None:
    assert importlib.util.find_spec("pandas") is not None
    write_parquet(tmp_path / "log.parquet", signals())
    (tmp_path / "plain.toml").write_text(AXIS)
    (tmp_path / "recorded.toml").write_text(AXIS + "[record]\nsamples = true\nsegment_s = 1.0\n")
    code = (
        "import sys; from livebode.cli.app import app\n"
        "for name in ('plain', 'recorded'):\n"
        "    app(['run', f'{sys.argv[1]}/{name}.toml', '--out', f'{sys.argv[1]}/{name}'], standalone_mode=False)\n"
        "print('pandas' in sys.modules)"
    )
    run = [sys.executable, "-c", code, tmp_path]
    done = subprocess.run(run, capture_output=True, text=True, check=True)
    assert (tmp_path / "plain" / "parameters.parquet").exists()
    assert (tmp_path / "recorded" / "parameters").exists()
    assert done.stdout.splitlines()[-1] == "False"
