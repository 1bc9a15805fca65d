"""One reader for every run: finished in one piece, finished in segments, killed, stopped, and being written."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from livebode.configuration import RecordSection
from livebode.core import Block, Event, RecordError
from livebode.estimation import Tracker
from livebode.records import RunDirectory, RunRecord, each_event, query
from tests.support.command import RATE_HZ, livebode, signals, write_parquet
from tests.support.errors import refused
from tests.support.recorded import (
    KEPT,
    NAMES,
    SETTINGS,
    check_beginning,
    check_whole,
    data,
    expected,
    machine,
    record_machine,
    same,
)  # fmt: skip
from tests.support.responses import as_recorded
from tests.support.runs import record

SAMPLES = 4000


class StopError(Exception):
    pass


def stop_at(sample: int) -> None:
    def progress(done: int, _: int | None) -> None:
        if done >= sample:
            raise StopError

    return progress


def record_until(sample: int, directory: Path, **options: object) -> None:
    with pytest.raises(StopError):
        record_machine(machine(SAMPLES), directory, progress=stop_at(sample), **options)


def each(run: RunRecord) -> list[Event]:
    """Its events as they happened, before they were grouped."""
    return [one for event in run.events() for one in each_event(event)]


def test_segments_and_one_piece_hold_the_same(tmp_path: Path) -> None:
    record_machine(machine(SAMPLES), tmp_path / "segments")
    record(machine(SAMPLES), Tracker(SETTINGS), tmp_path / "piece", about={})
    check_whole(tmp_path / "segments", SAMPLES)
    runs = [RunRecord.open(tmp_path / name) for name in ("segments", "piece")]
    assert same(as_recorded(runs[0].responses()), runs[1].responses())
    assert runs[0].events() == runs[1].events()
    assert each(runs[0]) == list(expected(SAMPLES)[1])
    assert runs[0].summary["counts"] == runs[1].summary["counts"]
    assert [run.finished for run in runs] == [True, True]
    of_samples = [one for one in runs[0].segments if one.table in ("responses", "samples")]
    assert len(of_samples) == 2 * SAMPLES // RATE_HZ
    (whole,) = runs[1].segments
    assert (whole.name, whole.rows) == ("responses.parquet", runs[0].responses().value.size)
    newest = list(runs[0].batches(1))
    assert newest == []


@pytest.mark.parametrize("sample", [1, 700, 1850, 3990])
def test_a_run_that_ended_anywhere_is_read_and_continues(tmp_path: Path, sample: int) -> None:
    record_until(sample, tmp_path / "run")
    held = check_beginning(tmp_path / "run", SAMPLES, sample - RATE_HZ)
    assert not RunRecord.open(tmp_path / "run").finished
    reported: list[Event] = []
    record_machine(machine(SAMPLES), tmp_path / "run", report=reported.append)
    check_whole(tmp_path / "run", SAMPLES)
    assert [(event.kind, event.sample) for event in reported] == [("record-continued", held)]
    with refused(RecordError, "finished", path=str(tmp_path / "run")):
        record_machine(machine(SAMPLES), tmp_path / "run")


def test_a_run_is_read_while_it_is_written(tmp_path: Path) -> None:
    samples, directory = 4 * SAMPLES, tmp_path / "run"
    going, errors, found = threading.Event(), [], [(0, 0, 0)]
    responses, events = expected(samples)

    def read() -> None:
        while not going.wait(0.001):
            if (directory / "run.json").exists():
                run = RunRecord.open(directory)
                seen, reported = run.responses(), each(run)
                number = np.concatenate(
                    [np.zeros(0, int), *(t["sample"].to_numpy() for t in map(pa.table, run.tables("samples")))]
                )
                assert same(seen, responses[: len(seen)])
                assert reported == list(events[: len(reported)])
                assert np.array_equal(number, np.arange(number.size))
                found.append((len(seen), len(reported), number.size))
                assert found[-1] >= found[-2]

    def reading() -> None:
        try:
            read()
        except BaseException as error:
            errors.append(error)

    reader = threading.Thread(target=reading)
    reader.start()
    try:
        # Segments so short that they are closed beneath the reader all the time.
        record_machine(machine(samples), directory, kept=RecordSection(samples=True, segment_s=0.2))
    finally:
        going.set()
        reader.join()
    assert errors == []
    assert len(set(found)) > 3


def test_a_machine_that_cannot_go_back_leaves_a_gap(tmp_path: Path) -> None:
    record_until(1500, tmp_path / "run", again=False)
    held = check_beginning(tmp_path / "run", SAMPLES, 500)
    missing = 250
    without_end = replace(machine(SAMPLES), samples=None, first=held + missing)
    record_machine(without_end, tmp_path / "run", again=False)
    run = RunRecord.open(tmp_path / "run")
    assert not run.finished  # it was stopped, and may go on
    assert run.summary["counts"]["gaps"] == 1
    number = np.concatenate([table["sample"].to_numpy() for table in map(pa.table, run.tables("samples"))])
    assert np.array_equal(number, np.r_[:held, held + missing : held + missing + SAMPLES])
    # The same as if the machine had fallen silent for so long.
    tracker = Tracker(SETTINGS)
    parts = [
        tracker.process(Block(data(SAMPLES)[:, :held], NAMES, RATE_HZ)),
        tracker.process(Block(data(SAMPLES), NAMES, RATE_HZ, start=held + missing)),
    ]
    assert same(run.responses(), type(parts[0]).join(parts))
    assert [event.kind for event in run.events()].count("gap") == 1
    record_machine(replace(without_end, first=held + 2 * missing + SAMPLES), tmp_path / "run", again=False)
    assert RunRecord.open(tmp_path / "run").summary["counts"]["gaps"] == 2


def test_a_run_of_another_configuration_or_of_a_running_process_is_not_written(tmp_path: Path) -> None:
    record_until(700, tmp_path / "run")
    with refused(RecordError, "configuration-differs", path=str(tmp_path / "run")):
        record_machine(machine(SAMPLES), tmp_path / "run", kept=RecordSection(samples=False))
    held = check_beginning(tmp_path / "run", SAMPLES, 0)

    def meanwhile(done: int, _: int | None) -> None:
        if done > 2000:
            with refused(RecordError, "locked", path=str(tmp_path / "run")):
                record_machine(machine(SAMPLES), tmp_path / "run")
            with refused(RecordError, "locked"), RunDirectory(tmp_path / "run", force=True):
                raise AssertionError("a run that is being written is not replaced by one in one piece")
            raise StopError

    with pytest.raises(StopError):
        record_machine(machine(SAMPLES), tmp_path / "run", progress=meanwhile)
    assert check_beginning(tmp_path / "run", SAMPLES, 1000) > held
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("years of work")
    with refused(RecordError, "foreign-files", files=["thesis.tex"]):
        record_machine(machine(SAMPLES), tmp_path / "mine")


def test_a_continued_run_may_have_segments_of_another_length(tmp_path: Path) -> None:
    record_until(1700, tmp_path / "run")
    record_machine(machine(SAMPLES), tmp_path / "run", kept=KEPT.model_copy(update={"segment_s": 60.0}))
    check_whole(tmp_path / "run", SAMPLES)
    assert len(list((tmp_path / "run" / "responses").iterdir())) == 2


@pytest.fixture(scope="module")
def asked(tmp_path_factory: pytest.TempPathFactory) -> tuple[object, ...]:
    """A recording, what is asked of it, and where the run is to go; `whole` beside the recording was never ended."""
    folder = tmp_path_factory.mktemp("asked")
    log = write_parquet(folder / "log.parquet", signals(24_000))
    lines = ("--lines", "50,100,200", "--window", 100, "--hop", 10)
    asked = (log, "--excitation", "w", "--input", "u", "--output", "y", *lines, "--out")
    assert livebode("run", *asked, folder / "whole").code == 0
    return asked


@pytest.fixture
def given(tmp_path: Path, asked: tuple[object, ...]) -> tuple[object, ...]:
    return (*asked, tmp_path / "run", "--continue")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_the_same_command_continues_where_it_was_ended(
    tmp_path: Path, given: tuple[object, ...], number: signal.Signals
) -> None:
    # Ended from within, after two thirds of the recording.
    code = (
        "import os, signal, sys; import livebode.runtime.segmented as s; from livebode.cli import main\n"
        # What starts the tests in the background may have told them to ignore it.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "pieces = s.SegmentedRecord.pieces\n"
        "def ended(self, block):\n"
        "    for piece in pieces(self, block):\n"
        f"        if piece.start > 16_000: os.kill(os.getpid(), {int(number)})\n"
        "        yield piece\n"
        f"s.SegmentedRecord.pieces = ended; sys.argv = {['livebode', 'run', *map(str, given)]!r}; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == (-number if number == signal.SIGKILL else 128 + number), done.stderr
    assert "Traceback" not in done.stderr
    assert ("continues the run" in done.stderr) == (number != signal.SIGKILL)
    run = RunRecord.open(tmp_path / "run")
    assert run.responses().sample[-1] > 16_000 - RATE_HZ
    assert livebode("run", *given).code == 0
    whole = Path(str(given[0])).with_name("whole")
    assert same(as_recorded(RunRecord.open(tmp_path / "run").responses()), RunRecord.open(whole).responses())
    assert (tmp_path / "run" / "bode.svg").stat().st_size > 3_000
    assert "is finished" in livebode("run", *given).err
    assert livebode("run", *given, "--force").code == 0


def test_averages_in_sql_leave_out_missing_values_of_either_precision(tmp_path: Path) -> None:
    pytest.importorskip("duckdb", reason="DuckDB is not installed")
    record_machine(machine(SAMPLES), tmp_path / "run")
    run = RunRecord.open(tmp_path / "run")
    responses = run.responses()
    for name in ("coherence", "sigma"):  # four bytes, and eight
        values = getattr(responses, name)
        assert 0 < np.isnan(values).sum() < values.size
        (row,) = query(run, f"SELECT avg({name}), count({name}) FROM responses", 1).rows
        assert row == pytest.approx((np.nanmean(values), np.isfinite(values).sum()), rel=1e-6)


def test_other_tools_read_the_segments(tmp_path: Path) -> None:
    duckdb = pytest.importorskip("duckdb", reason="DuckDB is not installed")
    record_machine(machine(SAMPLES), tmp_path / "run")
    responses = RunRecord.open(tmp_path / "run").responses()
    rows = duckdb.sql(f"SELECT re FROM '{tmp_path}/run/responses/*.parquet' ORDER BY sample, frequency_hz").fetchall()
    assert np.array_equal(np.array(rows)[:, 0], responses.value.real.ravel(), equal_nan=True)
    assert duckdb.sql(f"SELECT count(*) FROM '{tmp_path}/run/manifest.jsonl'").fetchall() == [(10,)]
    kinds = [kind for (kind,) in duckdb.sql(f"SELECT kind FROM '{tmp_path}/run/events.jsonl'").fetchall()]
    assert kinds == ["noise-from-detection-lines", "non-finite", "spike"]
    table = pq.read_table(tmp_path / "run" / "samples")
    assert np.array_equal(table["u"].to_numpy(), data(SAMPLES)[1])
    for segment in RunRecord.open(tmp_path / "run").segments:
        stop = 0
        for part in segment.parts:
            stop += part.size_bytes
            command = f"head -c {stop} {tmp_path / 'run' / segment.name} | tail -c {part.size_bytes} | sha256sum"
            done = subprocess.run(command, shell=True, capture_output=True, text=True, check=True)
            assert done.stdout.split()[0] == part.sha256
        assert (tmp_path / "run" / segment.name).stat().st_size == stop


@pytest.mark.parametrize("sample", [900, 3500, None])
def test_a_query_sees_what_is_committed(tmp_path: Path, sample: int | None) -> None:
    if sample is None:
        record_machine(machine(SAMPLES), tmp_path / "run")
    else:
        record_until(sample, tmp_path / "run")
    held = check_beginning(tmp_path / "run", SAMPLES, 0)
    due = expected(SAMPLES)[0]
    due = due[: int(np.count_nonzero(due.sample < held))]

    def ask(sql: str, *options: object) -> dict[str, object]:
        done = livebode("export", tmp_path / "run", "--sql", sql, "--json", *options)
        assert done.code == 0, done.err
        return json.loads(done.out)

    assert ask("SELECT max(sample) + 1 AS held, count(*) FROM samples")["rows"] == [[held, held]]
    found = ask("SELECT sum(re), count(*) FROM responses WHERE valid")["rows"][0]
    assert found[1] == np.count_nonzero(due.valid)
    assert found[0] == pytest.approx(due.value[due.valid].real.sum())
    documented = "SELECT frequency_hz, avg(coherence) FROM responses WHERE valid GROUP BY ALL ORDER BY 1"
    known = due.valid & np.isfinite(due.coherence)  # the first period has no coherence yet
    usual = np.mean(due.coherence, axis=0, where=known)
    np.testing.assert_allclose(np.array(ask(documented)["rows"])[:, 1], usual)
    first = ask("FROM responses ORDER BY sample, frequency_hz", "--rows", 2)
    assert (first["more"], len(first["rows"]), first["columns"][0]) == (True, 2, "first")
    assert ask("SELECT count(*) FROM events WHERE kind = 'non-finite'")["rows"] == [[int(held > SAMPLES // 3)]]
    text = livebode("export", tmp_path / "run", "--sql", "SELECT sample, valid FROM responses LIMIT 1", "--csv").out
    assert text == f"sample,valid\n{due.sample[0]},False\n"


@pytest.mark.parametrize(
    ("sql", "message"),
    [
        ("FROM responsess", "Did you mean"),
        ("SELEC 1", "syntax error"),
        ("FROM parameters", "query the tables of this run: events, single_events, responses, samples"),
        ("FROM read_csv('/etc/passwd')", "disabled by configuration"),
        ("COPY responses TO '{run}/x.csv'", "disabled by configuration"),
        ("ATTACH '{run}/x.db'", "disabled by configuration"),
        ("SET enable_external_access = true", "cannot be run"),
        ("FROM sys", "does not exist"),
    ],
)
def test_a_query_that_cannot_be_run_is_refused(tmp_path: Path, sql: str, message: str) -> None:
    record_until(1200, tmp_path / "run")
    before = sorted(os.listdir(tmp_path / "run"))
    done = livebode("export", tmp_path / "run", "--sql", sql.format(run=tmp_path / "run"))
    assert done.code == 2
    assert message in done.err
    assert sorted(os.listdir(tmp_path / "run")) == before


def test_a_constant_excitation_is_reported_and_the_run_is_finished(tmp_path: Path) -> None:
    silent = replace(machine(SAMPLES), data=data(SAMPLES) * np.array([[0.0], [1.0], [1.0], [1.0]]))
    record_machine(silent, tmp_path / "run")
    run = RunRecord.open(tmp_path / "run")
    assert run.finished
    assert len(run.responses()) == SAMPLES // SETTINGS.step
    assert ["constant at 0" in event.message for event in run.events() if event.kind == "doubtful"] == [True]


def test_an_empty_or_interrupted_query_ends_in_a_sentence(tmp_path: Path) -> None:
    record_machine(machine(SAMPLES), tmp_path / "run")
    for sql in ("", "  ;", "/* nothing */"):
        done = livebode("export", tmp_path / "run", "--sql", sql)
        assert (done.code, done.out) == (2, "")
        assert "the query is empty; write SQL on events, single_events, responses, samples" in done.err
    command = [str(Path(sys.executable).with_name("livebode")), "export", str(tmp_path / "run"), "--sql"]
    # What runs the tests may ignore the signal, and what it starts with it.
    process = subprocess.Popen(
        [*command, "SELECT 1; SELECT count(*) FROM range(100000000) a, range(100000) b WHERE a.range * b.range = 3"],
        stderr=subprocess.PIPE, text=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    # It is asking once it has used the processor for longer than it takes to start.
    while sum(map(int, Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()[11:13])) < 170:
        time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    assert process.communicate()[1].strip() == "livebode: stopped; no file is half written"
    assert process.returncode == 130
