"""A run loads what it uses: each library that it does without is time before the first sample."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from tests.support.command import signals, write_parquet

UNUSED = {"pandas", "xarray", "control", "starlette", "uvicorn", "deltalake", "nats", "fsspec", "typst", "duckdb"}
UNUSED |= {"scipy", "matplotlib", "PIL"}


def test_a_run_with_pictures_loads_neither_scipy_nor_matplotlib_nor_a_server(tmp_path: Path) -> None:
    log = write_parquet(tmp_path / "log.parquet", signals())
    options = "--excitation w --input u --output y --lines 50,100,200 --window 100 --time t"
    words = f"run {log} --out {tmp_path / 'run'} {options}"
    code = f"""
import sys
from livebode.cli import main
sys.argv[1:] = {words.split()!r}
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
print()
print(*sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run" / "bode.svg").exists()
    assert UNUSED & set(done.stdout.splitlines()[-1].split()) == set()
