"""Runs are recorded, read and shown where PyArrow cannot be imported; those that PyArrow wrote have the same values."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from livebode.tables import ParquetFile

STORED = Path(__file__).parent / "stored" / "3"
SOURCE = Path(__file__).parents[2] / "src" / "livebode"
NEED_IT = {
    "records/_query.py",
    "records/segments/verified_files.py",
    "sources/pyarrow_files.py",
    "tables/parquet_file.py",
    "tables/pyarrow_arrays.py",
}
"""Modules that are imported where PyArrow is needed."""
PROGRAM = """
import json, sys
sys.modules["pyarrow"] = None
from pathlib import Path
from urllib.request import urlopen
import numpy as np
from livebode.dashboard import Dashboard, ServerSettings
from livebode.records import RunRecord
from tests.support import stored
from tests.support.recorded import check_whole, machine, record_machine

folder, earlier = map(Path, sys.argv[1:])
record_machine(machine(3000), folder / "recorded")
check_whole(folder / "recorded", 3000)
run = RunRecord.open(earlier / "segments")
samples = np.concatenate([[table[name] for name in stored.NAMES] for table in run.tables("samples")], axis=1)
pages = Dashboard(ServerSettings("127.0.0.1", 0))
pages.view_all(folder)
with pages, urlopen(f"{pages.url}api/runs") as answer:
    shown = json.load(answer)["names"]
read = {"responses": stored.content(run.responses()), "samples": stored.digest(samples)}
print(json.dumps([read, shown]))
"""


def test_a_run_is_recorded_read_and_shown_without_pyarrow(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM, tmp_path, STORED], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == [json.loads((STORED / "expected.json").read_text()), ["recorded"]]


@pytest.mark.parametrize("path", sorted(STORED.rglob("*.parquet")), ids=lambda path: str(path.relative_to(STORED)))
def test_the_file_of_an_earlier_run_has_the_bits_that_pyarrow_reads(path: Path) -> None:
    found, expected = ParquetFile(path.read_bytes()).table(), pq.read_table(path)
    assert found.column_names == expected.column_names
    for name in found.column_names:
        want = expected[name].to_numpy(zero_copy_only=False)
        if want.dtype == object:
            assert found.text(name).to_list() == want.tolist()
        else:
            assert (found[name].dtype, found[name].tobytes()) == (want.dtype, np.ascontiguousarray(want).tobytes())


def test_only_those_import_pyarrow_that_are_named_here() -> None:
    found = {str(path.relative_to(SOURCE)) for path in SOURCE.rglob("*.py") if _imports(path)}
    assert found == NEED_IT


def _imports(path: Path) -> bool:
    """Whether it imports PyArrow, or the conversions to its arrays, anywhere."""
    names = set()
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            names |= {one.name for one in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {node.module or ""} | {f"{node.module}.{one.name}" for one in node.names}
    conversions = {f"livebode.tables.{name}" for name in ("from_numpy", "text", "to_numpy")}
    return any(name.partition(".")[0] == "pyarrow" or name in conversions for name in names)
