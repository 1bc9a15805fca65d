"""A matrix run records what a MatrixTracker computes, however the run is cut, stopped, and read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import livebode
from livebode.configuration import Axis, recorded_configuration
from livebode.core import Block, Channel, ConfigError, RecordError, SignalError
from livebode.records import RunRecord
from livebode.runtime import Destination, Document, TrackerResults, run
from livebode.simulation import GantryLoop
from livebode.sources.live import Batch, encode_line
from livebode_matrix import MatrixSettings, MatrixTracker
from tests.support.command import write_parquet
from tests.support.errors import refused
from tests.support.gantry_runs import (
    DWELL,
    LINES,
    NAMES,
    RATE_HZ,
    SETTLE,
    gantry_axis,
    gantry_block,
    gantry_log,
    gantry_run,
)
from tests.support.live_runs import started
from tests.support.peers.peer import PATIENCE_S

SETTINGS = MatrixSettings(
    lines=LINES, output=NAMES[4:], input=NAMES[2:4], excitation=NAMES[:2], dwell=DWELL, settle=SETTLE, memory=3, hop=200
)
SEGMENTS = {"segment_s": 1.0}


class StopError(Exception):
    pass


@pytest.fixture(scope="module")
def block() -> Block:
    return gantry_block()


@pytest.fixture(scope="module")
def log(block: Block, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return gantry_log(tmp_path_factory.mktemp("gantry") / "gantry.parquet", block)


@pytest.fixture(scope="module")
def recorded(log: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return gantry_run(gantry_axis(log), tmp_path_factory.mktemp("runs") / "run").directory


def test_a_run_is_read_back_bit_for_bit(recorded: Path, block: Block) -> None:
    expected, found = MatrixTracker(SETTINGS).process(block), livebode.Run(recorded).matrix
    assert len(found) > 20
    for name in type(found)._ARRAYS:
        one, other = getattr(found, name), getattr(expected, name)
        assert one.dtype == other.dtype, name
        assert np.array_equal(np.isnan(one), np.isnan(other)), name
        assert np.array_equal(np.nan_to_num(one), np.nan_to_num(other)), name
    assert np.array_equal(found.covariance, expected.covariance, equal_nan=True)


def test_the_bounds_of_a_run_in_closed_loop_cover_the_truth(recorded: Path) -> None:
    found = livebode.Run(recorded).matrix
    truth = GantryLoop().gantry.response(LINES.frequency_hz, RATE_HZ)[:, :2]
    error, bound = np.abs(found.value[-1] - truth), found.bound(3.5)[-1]  # each with 1 − 5e-6
    assert np.isfinite(bound).all()
    assert (error < bound).all()


def test_an_entry_reads_as_an_ordinary_run(recorded: Path) -> None:
    whole = RunRecord.open(recorded, matrix=True)
    matrix = whole.matrix()
    for name, (output, input) in whole.entries.items():
        view = livebode.Run(recorded, entry=name)
        assert view.responses.equals(matrix.entry(output, input))
        assert view.summary["configuration"]["signals"]["output"] == output
        assert view.average.valid.all()
    fit = livebode.Run(recorded, entry="velocity1/u1")
    assert fit.average.frequency_hz.tolist() == LINES.frequency_hz.tolist()


def test_the_recorded_configuration_is_that_of_the_run(recorded: Path, log: Path) -> None:
    words = recorded_configuration(RunRecord.open(recorded, matrix=True).summary)
    assert Axis.of(words, "run.json").signals == gantry_axis(log).signals


def test_where_one_entry_is_needed_the_error_names_them(recorded: Path, tmp_path: Path) -> None:
    every = ["velocity1/u1", "velocity1/u2", "velocity2/u1", "velocity2/u2"]
    with refused(RecordError, "entry-missing", allowed=every):
        RunRecord.open(recorded)
    with refused(RecordError, "entry-missing", allowed=every):
        livebode.Run(recorded).responses  # noqa: B018
    with refused(RecordError, "entry-unknown", allowed=every):
        RunRecord.open(recorded, entry="velocity1/u3")
    single = livebode.example_run(tmp_path / "single")
    with refused(RecordError, "no-matrix"):
        RunRecord.open(single.path, entry="velocity1/u1")
    with refused(RecordError, "no-matrix"):
        single.matrix  # noqa: B018


def test_a_stopped_run_continues_as_if_it_had_not_been_stopped(log: Path, tmp_path: Path, recorded: Path) -> None:
    axis = gantry_axis(log, record=SEGMENTS)
    for until in (7000, 21_000):
        with pytest.raises(StopError):
            run(axis, Destination(tmp_path / "run", lambda *_: None, subscribers=(stopping(until),)))
    resumed, whole = gantry_run(axis, tmp_path / "run"), livebode.Run(recorded)
    found = livebode.Run(tmp_path / "run")
    assert found.finished
    assert found.matrix.equals(whole.matrix)
    for part in ("counts", "columns", "condition"):
        assert resumed.summary[part] == whole.summary[part], part


def stopping(until: int) -> Any:
    def stop(document: Document) -> None:
        if isinstance(document, TrackerResults) and document.samples > until:
            raise StopError

    return stop


def test_a_live_source_gives_what_the_recording_gives(block: Block, recorded: Path, tmp_path: Path) -> None:
    channels = tuple(Channel(name, "") for name in NAMES)
    sent = [
        Batch(900 + at, block.data[:, at : at + 400].copy(), channels, float(RATE_HZ), 9)
        for at in range(0, len(block), 400)
    ]
    path = tmp_path / "axis.toml"
    path.write_text(
        f"""
        [source]
        url = "stdin:"
        [signals]
        output = ["velocity1", "velocity2"]
        input = ["u1", "u2"]
        excitation = ["w1", "w2"]
        [lines]
        frequencies = "10:60:5"
        window = 800
        [tracking]
        hop = 200
        [experiments]
        dwell_periods = {DWELL}
        settle_periods = {SETTLE}
        memory = 3
        """
    )
    with started(path, tmp_path / "live") as process:
        _, err = process.communicate(b"".join(map(encode_line, sent)), PATIENCE_S)
    assert (process.returncode, err) == (0, b"")
    live = livebode.Run(tmp_path / "live")
    assert live.matrix.equals(livebode.Run(recorded).matrix)
    assert live.summary["columns"] == livebode.Run(recorded).summary["columns"]


def test_one_input_with_several_outputs_costs_one_run(block: Block, tmp_path: Path) -> None:
    u = np.tile(block["w1"][:800], 8)
    data = np.vstack([u, 2 * u, -u, 0.5 * u])
    log = write_parquet(tmp_path / "log.parquet", {"t [s]": np.arange(len(u)) / RATE_HZ, **dict(zip("uabc", data))})
    signals = {"output": ["a", "b", "c"], "input": "u"}
    axis = gantry_axis(log, signals=signals, tracking={"estimator": "direct"}, experiments={"number": 1})
    found = livebode.Run(gantry_run(axis, tmp_path / "run").directory).matrix
    assert np.allclose(found.value[-1, :, :, 0], [2, -1, 0.5])


def test_gaps_make_columns_invalid_and_are_counted(block: Block, tmp_path: Path) -> None:
    damaged = block.data.copy()
    damaged[2, 17_000] = np.nan
    log = gantry_log(tmp_path / "log.parquet", Block(damaged, NAMES, rate_hz=RATE_HZ))
    outcome = gantry_run(gantry_axis(log), tmp_path / "run")
    assert outcome.summary["counts"]["non-finite"] == 1
    assert [column["reasons"] for column in outcome.summary["columns"]]
    assert "non-finite" in [event.kind for event in livebode.Run(tmp_path / "run").events]


def test_inputs_that_do_not_separate_are_refused_with_the_reason(block: Block, tmp_path: Path) -> None:
    data = block.data.copy()
    data[1], data[3] = data[0], data[2]  # both motors always move together
    log = gantry_log(tmp_path / "log.parquet", Block(data, NAMES, rate_hz=RATE_HZ))
    with pytest.raises(SignalError, match="moves together with others") as caught:
        gantry_run(gantry_axis(log), tmp_path / "run")
    assert caught.value.code == "signal.no-valid-response"
    assert not (tmp_path / "run").exists()


def test_the_described_controllers_give_the_indirect_estimate(log: Path, recorded: Path, tmp_path: Path) -> None:
    loop = GantryLoop()
    pid = {"gain": loop.gain_n_m_s, "integral_time_s": loop.integral_time_s, "rate_hz": RATE_HZ}
    controllers = [{"output": f"velocity{i}", "input": f"w{i}", "velocity": pid} for i in (1, 2)]
    signals = {"output": ["velocity1", "velocity2"], "excitation": ["w1", "w2"]}
    axis = gantry_axis(
        log, signals=signals, loop={"controllers": controllers}, tracking={"estimator": "indirect", "hop": 200}
    )
    found = livebode.Run(gantry_run(axis, tmp_path / "run").directory).matrix
    joint = livebode.Run(recorded).matrix
    assert found.inputs == ("w1", "w2")
    assert np.allclose(found.value[-1], joint.value[-1], rtol=0.02)


@pytest.mark.parametrize(
    ("sections", "code", "message"),
    [
        ({"signals": {"output": ["a", "b"], "input": ["u", "v"], "excitation": "w"}}, "value-mismatch", "excitation 1"),
        ({"signals": {"output": ["a", "a"], "input": "u", "excitation": "w"}}, "key-conflict", "two signals"),
        ({"fit": {}}, "key-conflict", "single response"),
        ({"tracking": {"hann": True}}, "key-conflict", "tracking.hann"),
        ({"tracking": {"estimator": "indirect"}}, "key-missing", "controllers"),
        ({"lines": {"frequencies": "auto", "window": 800}}, "incomplete", "'auto'"),
        ({"signals": {"output": "a", "input": "u", "excitation": "w"}}, "key-conflict", "experiments belongs"),
        ({"signals": {"output": ["a"] * 9}}, "value-invalid", "at most 8"),
    ],
)
def test_keys_that_do_not_fit_are_refused(sections: dict[str, Any], code: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message) as caught:
        gantry_axis(Path("log.csv"), **sections)
    assert caught.value.code == f"config.{code}"
