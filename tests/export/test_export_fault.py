"""What cannot be exported is said in one sentence, and nothing is left half written."""

from __future__ import annotations

import resource
import sys
from pathlib import Path
from types import FrameType

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from livebode.core import Lines, OutputError, RecordError, SignalError
from livebode.export import nearest_response, save, write_csv, write_mat, write_netcdf, write_uff
from livebode.fitting import mean_response
from tests.support.command import livebode, signals, write_parquet
from tests.support.errors import refused
from tests.support.responses import made
from tests.support.runs import describe

LINES = Lines.parse("20:140:20", 4000, 400)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export")
    log, out = write_parquet(folder / "log.parquet", signals()), folder / "run"
    given = ("--excitation", "w", "--input", "u", "--output", "y", "--lines", "50,100,200", "--window", 100)
    assert livebode("run", log, *given, "--hop", 10, "--out", out).code == 0
    return out


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--to", "excel"), "'excel' is not a format for responses; choose csv, mat, netcdf or uff"),
        (("--to", "uff", "--parameters"), "'uff' is not a format for parameters; choose csv or mat"),
        (("--to", "xarray"), "xarray is not a file format; in Python use livebode.Run(path).responses.to_xarray()"),
        (("--to", "control"), "control is not a file format; in Python use livebode.Run(path).average.to_frd()"),
        (("--to", "csv", "--at", "1", "--mean"), "--at and --mean exclude each other"),
        (("--to", "csv", "--at", "nan"), "nan is not finite; give seconds in the recording's clock"),
        (("--to", "csv", "--at", "99"), "no valid response is within half a window (0.05 s) of 99 s; use the nearest"),
        (("--to", "csv", "--parameters"), "has no parameters: no model was fitted"),
    ],
)
def test_impossible_options_of_export_are_refused_in_one_sentence(
    run: Path, tmp_path: Path, options: tuple[str, ...], sentence: str
) -> None:
    done = livebode("export", run, *options, "--out", tmp_path / "a")
    assert (done.code, done.out) == (2, "")
    assert sentence in done.err
    assert done.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_missing_run_and_an_unusable_output_path_are_reported(run: Path, tmp_path: Path) -> None:
    assert "is not the directory of a run" in livebode("export", tmp_path, "--to", "csv").err
    assert "is a directory" in livebode("export", run, "--to", "csv", "--out", tmp_path).err
    file = tmp_path / "file"
    file.write_text("")
    assert "could not be written: " in livebode("export", run, "--to", "csv", "--out", file / "a.csv").err


def test_a_damaged_table_leaves_nothing(run: Path, tmp_path: Path) -> None:
    broken = tmp_path / "broken"
    broken.mkdir()
    table = pq.read_table(run / "responses.parquet")
    pq.write_table(table.slice(0, table.num_rows - 1), broken / "responses.parquet", compression="lz4")
    describe(broken, run)
    for to in ("csv", "mat", "netcdf", "uff"):
        done = livebode("export", broken, "--to", to)
        assert done.code == 2
        assert "ends within a response" in done.err
    pq.write_table(pa.table({"time_s": [1.0]}), broken / "parameters.parquet", compression="lz4")
    describe(broken, run)
    assert "have no column 'schedule'" in livebode("export", broken, "--to", "csv", "--parameters").err
    (broken / "parameters.parquet").write_bytes(b"PAR1")
    assert "parameters.parquet is damaged" in livebode("export", broken, "--to", "csv", "--parameters").err
    assert list(tmp_path.iterdir()) == [broken]


@pytest.mark.parametrize("write", [write_csv, write_mat, write_netcdf, write_uff])
def test_a_file_at_its_size_limit_is_reported_and_leaves_no_partial_file(write, tmp_path: Path) -> None:
    lines = Lines(tuple(range(1, 900)), 2000, 4000.0)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (9000, hard))
    try:
        with refused(OutputError, "not-written", reason="the file has its largest size"):
            save(tmp_path / "a", lambda partial: write(partial, [made(1, lines)]))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert list(tmp_path.iterdir()) == []


def test_the_end_of_the_program_is_no_fault_within_pyuff(tmp_path: Path) -> None:
    def ended(frame: FrameType, _event: str, _argument: object) -> None:
        if frame.f_code.co_name == "_opt_fields":
            raise SystemExit(143)

    sys.setprofile(ended)
    try:
        with pytest.raises(SystemExit):
            save(tmp_path / "a.uff", lambda partial: write_uff(partial, [made(3, LINES)]))
    finally:
        sys.setprofile(None)
    assert list(tmp_path.iterdir()) == []


def test_formats_held_in_memory_refuse_more_values_than_their_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("livebode.export.result.VALUES_MAX", 100)
    parts = [made(10, LINES), made(10, LINES)]
    for write, name in ((write_mat, "mat"), (write_netcdf, "netcdf")):
        with refused(OutputError, "too-large", format=name, limit=100):
            write(tmp_path / "a", parts)
    for write in (write_csv, write_uff):
        write(tmp_path / "a", parts)


def test_a_run_without_responses_is_refused(tmp_path: Path) -> None:
    for write in (write_csv, write_mat, write_netcdf):
        with refused(RecordError, "no-responses"):
            write(tmp_path / "a", iter([]))
    invalid = made(5, LINES, hole=1.0)
    with refused(SignalError, "no-valid-response"):
        nearest_response([invalid], 0.0)
    with refused(SignalError, "no-valid-response"):
        mean_response([invalid])
    invalid.valid[:, 0], invalid.value[:, 0] = True, 1.0
    with refused(SignalError, "too-few-lines", lines_min=2):
        write_uff(tmp_path / "a", [invalid])


def test_an_existing_file_is_unchanged_when_writing_fails(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("mine")

    def fails(partial: Path) -> None:
        partial.write_text("half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        save(path, fails, force=True)
    assert (list(tmp_path.iterdir()), path.read_text()) == ([path], "mine")


def test_a_run_without_noise_has_a_mean() -> None:
    responses = made(40, LINES, hole=0.0)
    responses.sigma[:], responses.value[:], responses.dof[:] = 0.0, 2 - 1j, 9.0
    found = mean_response([responses])[0]
    np.testing.assert_allclose(found.value, 2 - 1j, rtol=1e-14)
    assert (found.sigma == 0).all()
