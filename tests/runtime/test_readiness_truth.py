"""A machine that is not ready is recorded but not assessed: by definition, on simulated machines, recorded and live."""

from __future__ import annotations

import signal
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode import Responses, learn
from livebode.analysis import mean_of
from livebode.configuration import Axis, ReadyCondition
from livebode.core import Block, Channel, ConfigError, Event, Lines, RecordError, SpectraLayout
from livebode.monitoring import ALARMS
from livebode.preparation.followers import check_spectra
from livebode.records import RunRecord
from livebode.runtime import ENDED, SUPPRESSED, Destination, TrackerResults, run
from livebode.runtime.readiness import Readiness
from livebode.simulation import TensionLoss
from livebode.sources.live import Batch, encode_layout, encode_samples
from livebode_reports.report_data import read
from livebode_reports.verdict import verdict
from tests.support.adjusted import (
    CHANNELS,
    OFF_S,
    RATE_HZ,
    SECTIONS,
    SIGNALS,
    SLACK_S,
    WINDOW,
    Columns,
    adjusted,
    baseline,
    columns,
    healthy,
    piece,
    ran,
)
from tests.support.command import livebode, write_parquet
from tests.support.errors import refused
from tests.support.live_runs import started
from tests.support.monitored import changes_of, recorded, watcher
from tests.support.peers.peer import PATIENCE_S, until
from tests.support.peers.plain import TcpPeer
from tests.support.recorded import same
from tests.support.runs import describe
from tests.support.uneven import stamped, write_csv

BEFORE_S, AFTER_S, LOSS = 4.0, 4.0, 0.05
READY_AGAIN_S = BEFORE_S + OFF_S + SLACK_S
OF_RESPONSE = {name for name, kind in ALARMS.items() if kind.of_response}
WATCH = 7


@cache
def machine(loss: float) -> Columns:
    return adjusted(BEFORE_S, AFTER_S, loss)


def watched() -> dict[str, Any]:
    return {"monitoring": {"baseline": baseline()}}


def alarms(record: RunRecord) -> list[Event]:
    return [event for event in record.events() if event.kind in OF_RESPONSE]


def whole(of: RunRecord) -> list[Event]:
    return [event for event in of.events() if not event.kind.startswith("record-")]


def unready(spans: list[tuple[int, int]], length: int) -> np.ndarray:
    state = np.ones(length, dtype=bool)
    for first, size in spans:
        state[first : first + size] = False
    return state


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(st.integers(0, 80), st.integers(1, 12)), max_size=5),
    st.lists(st.integers(1, 89), max_size=6),
    st.integers(0, 4),
)
def test_marks_and_events_are_those_of_the_definition_however_the_samples_are_cut(
    spans: list[tuple[int, int]], cuts: list[int], reach: int
) -> None:
    state = unready(spans, 90)
    stage, events, marks = Readiness(ReadyCondition("on"), WATCH, reach), [], []
    block = Block(state[np.newaxis].astype(float), ("on",), 10.0)
    for first, last in pairwise(sorted({0, 90, *cuts})):
        events += stage.take(block.cut(first, last))
        newest = np.arange(first, last)
        marks += stage.mark(responses(newest, known=last)).ready.tolist()
    ready = [state[max(0, n - WATCH + 1 - reach) : n + 1].all() for n in range(90)]
    late = np.array(marks) != ready
    assert np.all(np.array(ready)[late]), "a later sample within the reach may also mark a response"
    assert not late.any() or reach
    # From the first sample that is not ready to the end of a whole window, and the reach, that is.
    size, now, expected = WATCH + reach, False, []
    for n in range(90):
        if not now and not state[n]:
            now = True
            expected.append((SUPPRESSED, n))
        elif now and n >= size - 1 and state[n - size + 1 : n + 1].all() and not state[n - size]:
            now = False
            expected.append((ENDED, n))
    assert [(event.kind, event.sample) for event in events] == expected
    assert stage.summary(10.0)["suppressed_at_end"] == now


def responses(newest: np.ndarray, known: int) -> Responses:
    assert newest[-1] < known
    one, size = np.ones((len(newest), 1)), len(newest)
    lines = Lines((1,), WATCH, 10.0)
    return Responses(
        lines, one + 0j, one, np.full(size, 9.0), one, one > 0, newest - WATCH + 1, newest, newest / 10.0, newest / 1.0
    )


@given(st.lists(st.one_of(st.integers(0, 1 << 16), st.floats()), min_size=1), st.integers(0, 255), st.integers(0, 255))
def test_bits_are_compared_as_integers(values: list[float], mask: int, expected: int) -> None:
    def bits(value: float) -> bool:
        return float(value).is_integer() and abs(value) < 2**53 and int(value) & mask == expected

    found = ReadyCondition("word", mask, expected).holds(np.array(values, dtype=float))
    assert found.tolist() == [bits(value) for value in values]
    whole = ReadyCondition("word", None, expected).holds(np.array(values, dtype=float))
    assert whole.tolist() == [value == expected for value in values]


def test_only_a_change_that_remains_after_an_adjustment_is_an_alarm_with_the_usual_delay(tmp_path: Path) -> None:
    """The interval has a drive that is off, then a belt with 30 % less stiffness."""
    silent = ran(tmp_path / "healthy again", machine(0.0), ready="enabled", **watched())
    assert alarms(silent) == []
    assert [(e.kind, e.sample) for e in silent.events() if e.kind in (SUPPRESSED, ENDED)] == [
        (SUPPRESSED, round(BEFORE_S * RATE_HZ)), (ENDED, round(READY_AGAIN_S * RATE_HZ) + WINDOW - 1),
    ]  # fmt: skip
    without = alarms(ran(tmp_path / "without", machine(0.0), **watched()))
    assert {event.kind for event in without} == {"change"}, "in the interval, and nobody should act on it"
    assert all(event.time_s < READY_AGAIN_S for event in without)
    remains = alarms(ran(tmp_path / "remains", machine(LOSS), ready="enabled", **watched()))
    alone = piece(AFTER_S, 9, LOSS)
    reference = alarms(ran(tmp_path / "alone", columns(alone, np.ones(alone.shape[1])), **watched()))
    assert [e.kind for e in remains] == [e.kind for e in reference] == ["change", "change"]
    delays = [event.time_s - READY_AGAIN_S for event in remains]
    assert delays == pytest.approx([event.time_s for event in reference], abs=0.2)  # two windows
    assert [e.details["since_s"] for e in remains] == pytest.approx([READY_AGAIN_S] * 2, abs=0.1)
    record = RunRecord.open(tmp_path / "remains" / "run")
    assert record.summary["readiness"] == {
        "channel": "enabled", "suppressed_s": pytest.approx(OFF_S + SLACK_S + WINDOW / RATE_HZ, abs=1e-3),
        "responses": np.count_nonzero(~record.responses().ready), "suppressed_at_end": False,
    }  # fmt: skip
    assert "Not assessed for 3.1 s: the machine was not ready." in record.summary["monitoring"]["message"]


def test_a_channel_that_is_always_ready_changes_nothing_but_itself(tmp_path: Path) -> None:
    given = machine(LOSS) | {"enabled": np.ones(len(machine(LOSS)["t"]))}
    one, other = (ran(tmp_path / str(ready), given, ready=ready, **watched()) for ready in (None, "enabled"))
    assert whole(one) == whole(other)
    assert same(one.responses(), other.responses())
    assert one.summary["monitoring"] == other.summary["monitoring"]
    assert one.summary["fit"] == other.summary["fit"]


def test_bounds_after_an_adjustment_do_not_contain_it(tmp_path: Path) -> None:
    """As in a run of what is ready; with the slack belt in the scatter of periods, 7 of 15 such runs had an alarm."""
    given = adjusted(5.0, 5.0, 0.0, seed=27)
    ready = given["enabled"] > 0
    runs = [
        ran(tmp_path / "with", given, ready="enabled", **watched()),
        ran(tmp_path / "without", {name: values[ready] for name, values in given.items()} | ticks(ready), **watched()),
    ]
    assert [alarms(one) for one in runs] == [[], []]
    after, alone = (one.responses()[-180:] for one in runs)  # of the last 4.5 s
    assert np.allclose(after.value, alone.value, rtol=1e-9, atol=0)
    assert np.abs(np.log(after.sigma / alone.sigma)).max() < np.log(1.3), "0.8^n of the window across the cut remains"


def ticks(ready: np.ndarray) -> Columns:
    return {"t": np.arange(np.count_nonzero(ready)) / RATE_HZ}


def test_a_machine_that_is_ready_for_half_a_second_at_a_time_is_still_assessed(tmp_path: Path) -> None:
    """The detection needs 1 s of judged windows, and sums them over the interruptions."""
    data = piece(5.0, 9, LOSS)
    enabled = (np.arange(data.shape[1]) // (RATE_HZ // 2) % 2 == 0).astype(float)
    found = alarms(ran(tmp_path / "bursts", columns(data, enabled), ready="enabled", **watched()))
    assert [event.kind for event in found] == ["change", "change"]
    assert all(event.time_s < 3.0 for event in found)


def test_what_is_not_ready_is_recorded_with_its_flag_and_used_by_nothing(tmp_path: Path) -> None:
    """Mean, learning, fits, export and query of a run with an adjustment, compared with the healthy machine."""
    record = ran(tmp_path / "run", machine(0.0), ready="enabled")
    found = record.responses()
    first, last = round(BEFORE_S * RATE_HZ), round(READY_AGAIN_S * RATE_HZ)
    assert np.array_equal(found.ready, (found.sample < first) | (found.first >= last))
    assert found.valid[~found.ready].any(), "the slack belt is shown"
    steady = Responses.join(list(record.steady_batches()))
    assert steady.ready.all()
    fits = pq.read_table(record.path / "parameters.parquet")
    assert not set(fits["sample"].to_pylist()) & set(found.sample[~found.ready].tolist())
    learned, truth = (learn([path]).tables[0].mean.ravel() for path in (record.path, healthy()))
    known = np.isfinite(learned)
    assert known.any()
    assert np.abs(learned[known] / truth[known] - 1).max() < 0.02, "0.3 of the belt's stiffness would move it by half"
    out = tmp_path / "responses.csv"
    assert livebode("export", record.path, "--to", "csv", "--out", out).code == 0
    table = np.genfromtxt(out, delimiter=",", skip_header=1)
    assert np.array_equal(table[:: len(found.lines), -1] == 1, found.ready)
    query = livebode("export", record.path, "--sql", "SELECT count(*) AS n FROM responses WHERE NOT ready")
    assert str(np.count_nonzero(~found.ready) * len(found.lines)) in query.out


def test_several_recordings_of_an_adjusted_machine_are_those_of_the_healthy_one(tmp_path: Path) -> None:
    """Their mean, its validation on a recording, and the report."""
    logs = [write_parquet(tmp_path / f"{i}.parquet", adjusted(2.0, 3.0, 0.0, seed=20 + 5 * i)) for i in range(2)]
    signals = {"signals": SIGNALS | {"ready": "enabled"}, "source": {"log": logs}}
    axis = Axis.of(signals | SECTIONS, "the test")
    record = RunRecord.open(run(axis, Destination(tmp_path / "run", lambda *_: None)).directory)
    assert [event.kind for event in record.events() if event.kind in (SUPPRESSED, ENDED)] == [SUPPRESSED, ENDED] * 2
    assert not record.summary["between"]["differs"]
    mean, truth = mean_of(record)[0], mean_of(RunRecord.open(healthy()))[0]
    assert np.all(np.abs(mean.value - truth.value) < mean.bound(4.0) + truth.bound(4.0))
    assert "two-mass passes" in livebode("validate", record.path, "--on", logs[1]).out
    found = verdict(read(record.path))
    assert "Not assessed for 6.2 s: the machine was not ready." in [finding.text for finding in found]


def test_a_run_without_the_column_of_readiness_is_refused(tmp_path: Path) -> None:
    record = ran(tmp_path / "run", machine(0.0))
    assert record.responses().ready.all()
    path = record.path / "responses.parquet"
    pq.write_table(pq.read_table(path).drop_columns("ready"), path, compression="lz4")
    describe(record.path, record.path)
    with refused(RecordError, "unexpected-content", columns=pq.read_table(path).column_names):
        RunRecord.open(record.path).responses()


class StopError(Exception):
    pass


def test_a_resumed_run_has_the_state_of_the_machine(tmp_path: Path) -> None:
    log = write_parquet(tmp_path / "log.parquet", machine(LOSS))

    def record(name: str, stop_at: int | None = None) -> RunRecord:
        def stop(document: object) -> None:
            if isinstance(document, TrackerResults) and stop_at is not None and document.samples > stop_at:
                raise StopError

        signals = {"signals": SIGNALS | {"ready": "enabled"}, "source": {"log": log}, "record": {"segment_s": 4.0}}
        axis = Axis.of(signals | SECTIONS | watched(), "the test")
        run(axis, Destination(tmp_path / name, lambda *_: None, subscribers=(stop,)))
        return RunRecord.open(tmp_path / name)

    for at_s in (BEFORE_S + 1.0, READY_AGAIN_S):
        with pytest.raises(StopError):
            record("resumed", round(at_s * RATE_HZ))
    one, other = record("resumed"), record("whole")
    assert same(one.responses(), other.responses())
    assert np.array_equal(one.responses().ready, other.responses().ready)
    assert whole(one) == whole(other)
    assert one.summary["readiness"] == other.summary["readiness"]


def test_a_run_that_continues_another_one_reports_the_state_again() -> None:
    block = Block(np.repeat([1.0, 0.0, 1.0], [20, 10, 30])[np.newaxis], ("on",), 10.0)
    before, after = (Readiness(ReadyCondition("on"), WATCH) for _ in range(2))
    before.take(block.cut(0, 32))
    after.take_over(before)
    (again, ended) = after.take(block.cut(32, 60))
    assert (again.kind, again.sample, again.details["since_s"]) == (SUPPRESSED, 32, 2.0)
    assert again.details["value"] == 0.0
    assert (ended.kind, ended.sample) == (ENDED, 30 + WATCH - 1)
    assert after.mark(responses(np.arange(32, 60), 60)).ready.tolist() == [n - WATCH + 1 >= 30 for n in range(32, 60)]


class Machine(TcpPeer):
    layout = encode_layout(tuple(map(Channel, (*CHANNELS, "status_word"))), float(RATE_HZ), epoch=9)


def test_a_live_machine_with_a_status_word_is_assessed_as_its_recording(tmp_path: Path) -> None:
    """CiA 402: 0x0637 is operation enabled, 0x0650 is switch on disabled."""
    given = machine(LOSS)
    word = np.where(given["enabled"] > 0, 0x0637, 0x0650).astype(float)
    rows = np.array([*(given[name] for name in CHANNELS), word])
    text = "[signals]\n" + "".join(f'{role} = "{name}"\n' for role, name in SIGNALS.items()) + 'ready = "status_word"\n'
    text += f'[lines]\nfrequencies = "20:140:20"\nwindow = {WINDOW}\n[tracking]\nhop = 100\nnoise = "quiet"\n'
    text += '[fit]\nmodel = "two-mass"\nradius_m = 0.019\n'
    text += f'[monitoring]\nbaseline = "{baseline()}"\nready_mask = 0x6F\nready_value = 0x27\n'
    path, out = tmp_path / "axis.toml", tmp_path / "live"
    reported, lost = out / "events.jsonl", round((BEFORE_S + OFF_S + 1.0) * RATE_HZ)
    with Machine(tmp_path) as peer:
        path.write_text(f'[source]\nurl = "{peer.settings["url"]}"\n{text}')
        with started(path, out) as process:
            peer.wait_ready()
            assert peer._link is not None
            channels = tuple(map(Channel, (*CHANNELS, "status_word")))
            for at in range(0, rows.shape[1], 400):
                if at != lost:  # in the interval: a fault of the source is still reported
                    batch = Batch(at, rows[:, at : at + 400].copy(), channels, float(RATE_HZ), 9)
                    peer._link.sendall(encode_samples(batch, double=True))
            until(lambda: reported.exists() and '"change"' in reported.read_text("utf-8"), "the change")
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=PATIENCE_S)
    events = RunRecord.open(out).events()
    states = [(event.kind, event.sample) for event in events if event.kind in (SUPPRESSED, ENDED)]
    last = round(READY_AGAIN_S * RATE_HZ)
    assert states == [(SUPPRESSED, round(BEFORE_S * RATE_HZ)), (ENDED, last + WINDOW - 1)]
    assert {event.kind for event in events} >= {"loss", "gap"}
    found = [event for event in events if event.kind in OF_RESPONSE]
    assert {event.kind for event in found} == {"change"}
    assert all(event.sample >= last for event in found)


REFUSED: list[tuple[dict[str, Any], str, dict[str, Any]]] = [
    ({"tracking": {"average": True}}, "key-conflict", {"keys": ["tracking.average", "signals.ready"]}),
    ({"monitoring": {"ready_mask": 1}}, "incomplete", {"key": "signals.ready"}),
    ({"output_only": {}}, "key-conflict", {"key": "signals.ready"}),
]


@pytest.mark.parametrize(("sections", "code", "facts"), REFUSED)
def test_what_cannot_honour_the_state_refuses_it(
    tmp_path: Path, sections: dict[str, Any], code: str, facts: dict[str, Any]
) -> None:
    log = write_parquet(tmp_path / "log.parquet", columns(piece(1.0, 1), np.ones(RATE_HZ)))
    signals = {"output": "velocity"} if "output_only" in sections else SIGNALS
    signals = signals | ({} if "monitoring" in sections else {"ready": "enabled"})
    lines = {} if "output_only" in sections else {"lines": SECTIONS["lines"]}
    with refused(ConfigError, code, **facts):
        axis = Axis.of({"source": {"log": log}, "signals": signals} | lines | sections, "the test")
        run(axis, Destination(tmp_path / "run", lambda *_: None))


def test_spectra_and_clocks_of_their_own_refuse_the_state(tmp_path: Path) -> None:
    signals = {"output": "y", "input": "u", "excitation": "w", "ready": "y"}
    live = Axis.of({"source": {"url": "udp://127.0.0.1:1"}, "signals": signals}, "the test")
    layout = SpectraLayout(tuple(map(Channel, "yuw")), (), 50, 10, (1, 2))
    with refused(ConfigError, "needs-samples", key="signals.ready"):
        check_spectra(live, layout, 1000.0)
    uneven = Axis.of(
        {"source": {"log": write_csv(tmp_path / "log.csv", stamped(same=True))}, "signals": signals}, "the test"
    )
    with refused(ConfigError, "needs-even-samples", key="signals.ready"):
        run(uneven, Destination(tmp_path / "run", lambda *_: None))


def test_the_model_of_a_moving_machine_sees_only_what_is_ready() -> None:
    """Strokes of the healthy machine, of one with 5 % less stiffness while it is adjusted, and of the healthy one."""
    parts = [recorded((0.32,), seed=80), recorded((0.32, 0.3), TensionLoss(start_s=0.0, loss=0.05), seed=81)]
    parts += [recorded((0.32,), seed=82)]
    data = np.concatenate([part.data[:, : len(part) // 400 * 400] for part in parts], axis=1)
    sizes = [len(part) // 400 * 400 for part in parts]
    enabled = np.repeat([1.0, 0.0, 1.0], sizes)
    block = Block(np.vstack([data, enabled]), (*parts[0].names, "enabled"), parts[0].rate_hz)
    condition, judged = ReadyCondition("enabled"), []
    for ready in (False, True):
        watching = watcher()
        events = [e for part in (condition.parts(block) if ready else [block]) for e in watching.process(part)]
        events += watching.finish()
        assert bool(changes_of(events)) != ready, events
        judged.append(watching.detector.judged)
    assert judged[1] > 0.5 * (sizes[0] + sizes[2]) / 400, "what is ready is judged"
