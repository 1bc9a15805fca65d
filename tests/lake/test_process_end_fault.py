"""A process that has read a lake of many small files ends without an abort."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pyarrow as pa

from livebode.lake import TABLES, Lake

READ = "import sys; from livebode.lake import Lake; print(len(Lake(sys.argv[1]).keys('runs')))"


def test_a_process_that_has_read_many_files_ends_normally(tmp_path: Path) -> None:
    lake = Lake(str(tmp_path / "lake"))
    for number in range(60):
        rows = [{"content": f"{number:032x}{row:032x}", "recipe": "r"} for row in range(100)]
        lake.add_rows("runs", pa.Table.from_pylist(rows, schema=TABLES["runs"].schema))
    for _ in range(3):
        done = subprocess.run([sys.executable, "-c", READ, str(tmp_path / "lake")], capture_output=True, text=True)
        assert (done.returncode, done.stdout, done.stderr) == (0, "6000\n", "")
