"""Reading a lake: a process ends without an abort, and a URL gives what a directory gives."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc

from livebode_plant.lake import TABLES, Lake
from tests.support.object_storage import BUCKET, object_storage

READ = "import sys; from livebode_plant.lake import Lake; print(len(Lake(sys.argv[1]).keys('runs')))"


def test_a_process_that_has_read_many_files_ends_normally(tmp_path: Path) -> None:
    lake = Lake(str(tmp_path / "lake"))
    for number in range(60):
        rows = [{"content": f"{number:032x}{row:032x}", "recipe": "r"} for row in range(100)]
        lake.add_rows("runs", pa.Table.from_pylist(rows, schema=TABLES["runs"].schema))
    for _ in range(3):
        done = subprocess.run([sys.executable, "-c", READ, str(tmp_path / "lake")], capture_output=True, text=True)
        assert (done.returncode, done.stdout, done.stderr) == (0, "6000\n", "")


def test_a_lake_at_a_url_gives_the_rows_and_columns_of_one_here(tmp_path: Path) -> None:
    with object_storage():
        found = []
        for place in (str(tmp_path / "lake"), f"s3://{BUCKET}/small"):
            lake = Lake(place)
            for number in range(3):
                rows = [{"content": f"{number}{row}", "recipe": "r", "machine": f"m{row}"} for row in range(4)]
                lake.add_rows("runs", pa.Table.from_pylist(rows, schema=TABLES["runs"].schema))
            some = Lake(place).read("runs", ["machine", "content"], pc.field("machine") == "m2")
            found.append(some.sort_by("content"))
            assert Lake(place).read("runs").schema.names == TABLES["runs"].schema.names
            lake.add_rows("runs", TABLES["runs"].schema.empty_table())
        here, there = found
        assert here.equals(there)
        assert there["content"].to_pylist() == ["02", "12", "22"]
