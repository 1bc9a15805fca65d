"""A command loads what it uses: each library that it does without is time before the first sample."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.command import signals, write_csv, write_parquet

SERVERS = {"asyncio", "http.client", "ssl", "starlette", "uvicorn", "nats", "fsspec"}
HEAVY = SERVERS | {
    "pandas",
    "xarray",
    "control",
    "deltalake",
    "typst",
    "duckdb",
    "pyarrow",
    "scipy",
    "matplotlib",
    "PIL",
}
MODELS = {"pydantic", "pydantic_core", "annotated_types", "importlib.metadata"}
OPTIONS = "--excitation w --input u --output y --lines 50,100,200 --window 100 --time t"


def loaded(words: str) -> set[str]:
    """The modules that a command has loaded at its end."""
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
    return set(done.stdout.splitlines()[-1].split())


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of a run of a text table, which needs no configuration, no model and no other library."""
    folder = tmp_path_factory.mktemp("run")
    loaded(f"example standstill --out {folder}")
    options = f"--out {folder / 'run'} --excitation w --input u --output velocity"
    found = loaded(f"run {folder / 'standstill.csv'} {options}")
    assert not found & (HEAVY | MODELS | {"tomllib", "logging.handlers"})
    return folder / "run"


def test_a_run_with_pictures_loads_neither_scipy_nor_matplotlib_nor_a_server(run: Path, tmp_path: Path) -> None:
    assert (run / "bode.svg").exists()
    log = write_parquet(tmp_path / "log.parquet", signals())
    unused = HEAVY - {"pyarrow", "asyncio", "http.client", "ssl"}  # PyArrow reads the log, and loads them
    assert not loaded(f"run {log} --out {tmp_path / 'run'} {OPTIONS}") & unused


@pytest.mark.parametrize("command", ["fit {}", "fit {} --json", "export {} --to csv --out {}.csv --force"])
def test_a_command_on_a_run_loads_neither_models_nor_a_server(command: str, run: Path) -> None:
    assert not loaded(command.format(run, run)) & (HEAVY | MODELS)


def test_an_inspection_loads_neither_models_nor_pictures(tmp_path: Path) -> None:
    log = write_csv(tmp_path / "log.csv", signals())
    assert not loaded(f"inspect {log}") & (HEAVY | MODELS)


def test_a_report_loads_no_server_and_no_scipy(run: Path) -> None:
    assert not loaded(f"report {run}") & (HEAVY - {"typst", "pyarrow"})
