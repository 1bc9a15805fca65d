"""A matrix run with a baseline finds the belt that loses stiffness, however it is cut, stopped and continued."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import livebode
from livebode.configuration import Axis, recipe_id
from livebode.core import BaselineError, ConfigError, Event, Lines, LivebodeError, StateError, UsageError
from livebode.dashboard import Quantities
from livebode.dashboard.overlays import overlays_of
from livebode.excitation import MatrixExcitation
from livebode.fitting import mean_matrix
from livebode.publishing.feed import AxisFeed
from livebode.runtime import Destination, run
from livebode.simulation import Gantry, GantryLoop
from livebode_matrix import MatrixMonitor, ResponseMatrix
from tests.support.command import livebode as command
from tests.support.command import write_parquet
from tests.support.errors import refused
from tests.support.gantry_runs import NAMES, gantry_run

RATE_HZ, NOISE_RAD_PER_S = 1000.0, 0.05
LINES = Lines.parse("5:100:2.5", rate_hz=RATE_HZ, window=400)
EXCITATION = MatrixExcitation.orthogonal(LINES, 2, amplitude=0.2, dwell=3, settle=2)
GANTRY = Gantry(motor_viscous_n_m_s=0.05, right_stiffness_n_per_m=4e5, right_damping_n_s_per_m=150.0)
WEAK = replace(GANTRY, stiffness_n_per_m=0.95 * 4e5)
CYCLE, MEMORY = EXCITATION.samples.shape[1], 3
SINCE = 7 * CYCLE
"""First sample of the weak belt: it is inside of a judged matrix, which therefore shows part of the change."""
LEARNED_S = 20 * CYCLE / RATE_HZ
SECTIONS: dict[str, Any] = {
    "signals": {"output": ["velocity1", "velocity2"], "input": ["u1", "u2"], "excitation": ["w1", "w2"]},
    "lines": {"frequencies": "5:100:2.5", "window": LINES.window},
    "tracking": {"hop": LINES.window, "average": True},
    "experiments": {"dwell_periods": 3, "settle_periods": 2, "memory": MEMORY},
}


class StopError(Exception):
    pass


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings, the description of the gantry, and the run `healthy`."""
    folder = tmp_path_factory.mktemp("gantry")
    recorded(folder / "long.parquet", [(GANTRY, 60)], 1)
    recorded(folder / "weak.parquet", [(GANTRY, 7), (WEAK, 8)], 2)
    recorded(folder / "repaired.parquet", [(WEAK, 6), (GANTRY, 9)], 3)
    values = {name: value for name, value in asdict(GANTRY).items() if value is not None}
    (folder / "gantry.toml").write_text("".join(f"{name} = {value}\n" for name, value in values.items()))
    gantry_run(axis(folder, "long", source={"log": folder / "long.parquet", "to": LEARNED_S}), folder / "healthy")
    return folder


def recorded(path: Path, parts: list[tuple[Gantry, int]], seed: int) -> None:
    """One recording of gantries in closed loop, one after the other, with repetitions of each; noise on the speeds."""
    rng, blocks = np.random.default_rng(seed), []
    for gantry, repetitions in parts:
        w = np.tile(EXCITATION.samples, repetitions)
        noise = NOISE_RAD_PER_S * rng.standard_normal((3, w.shape[1]))
        blocks.append(GantryLoop(gantry=gantry, rate_hz=RATE_HZ).simulate(w, noise=noise))
    data = {name: np.concatenate([block[name] for block in blocks]) for name in NAMES}
    write_parquet(path, {"t [s]": np.arange(len(data["w1"])) / RATE_HZ} | data)


def axis(folder: Path, log: str, monitoring: dict[str, Any] | None = None, **sections: Any) -> Axis:
    own = {"source": {"log": folder / f"{log}.parquet"}, "monitoring": monitoring or {}}
    return Axis.of(own | SECTIONS | sections, "test")


def compared(folder: Path, **more: Any) -> dict[str, Any]:
    return {"baseline": folder / "healthy", "gantry": folder / "gantry.toml"} | more


@pytest.fixture(scope="module")
def weak(folder: Path) -> livebode.Run:
    return livebode.Run(gantry_run(axis(folder, "weak", compared(folder)), folder / "weak").directory)


def changes(found: livebode.Run) -> list[Event]:
    return [event for event in found.events if event.kind.startswith("change")]


def test_the_belt_that_loses_stiffness_is_named_with_its_entry(weak: livebode.Run) -> None:
    """5 % less: the bounds of the first matrix after the change, at 4 sigma; the first one also has windows before."""
    first, corrected = changes(weak)
    assert (first.kind, corrected.kind) == ("change", "change-corrected")
    assert first.sample >= SINCE > first.details["since_sample"]
    assert corrected.details["since_sample"] == first.details["since_sample"]
    for event in (first, corrected):
        assert event.details["part"] == "left belt's stiffness"
        assert event.details["entry"] == "velocity1/u1"
    change = corrected.details["changes"][0]
    assert (change["name"], change["unit"]) == ("left belt's stiffness", "%")
    assert abs(change["amount"] + 5) < 2.05 * change["bound"]
    assert f"the left belt's stiffness is {-change['amount']:.3g} ±" in corrected.message
    assert "less than in the baseline; the response velocity1/u1 differs by" in corrected.message
    found = weak.summary["monitoring"]
    assert found["alarms"] == [first.message, corrected.message]
    assert (found["changes"], found["cleared"], found["standing"]) == (1, 0, ["left belt's stiffness"])
    assert found["message"].startswith("1 change against the baseline, 1 of them active at the end (")
    assert found["judged_s"] > 0.8 * 15 * CYCLE / RATE_HZ


def test_a_sink_receives_one_alarm_which_the_repair_ends(folder: Path, weak: livebode.Run, tmp_path: Path) -> None:
    mended = livebode.Run(gantry_run(axis(folder, "repaired", compared(folder)), tmp_path / "run").directory)
    kinds = [event.kind for event in changes(mended)]
    assert (kinds[0], kinds[-1]) == ("change", "change-cleared")
    assert mended.summary["monitoring"]["standing"] == []
    feed = AxisFeed("gantry", "")
    sent = [feed.message(event) for event in [*changes(weak), changes(mended)[-1]]]
    assert [message.condition for message in sent] == ["alarm", "alarm", "ended"]
    assert {message.cause for message in sent} == {"change: matrix"}


def test_without_a_description_the_entry_is_named(folder: Path, tmp_path: Path) -> None:
    """Also without average: the noise of a matrix is then from earlier windows, and hides the change for a time."""
    for average, memory in ((True, MEMORY), (False, 6)):
        sections = {"tracking": {"hop": LINES.window, "average": average}}
        sections["experiments"] = SECTIONS["experiments"] | {"memory": memory}
        healthy = folder / "healthy"
        found = livebode.Run(
            gantry_run(axis(folder, "weak", {"baseline": healthy}, **sections), tmp_path / f"{average}").directory
        )
        events = changes(found)
        assert events[0].message.startswith(f"Since {events[0].time_s:.1f} s the response velocity1/u1 differs from")
        assert [event.kind for event in events].count("change") == 1
        assert found.summary["monitoring"]["standing"] == ["velocity1/u1"]


def test_a_healthy_machine_stays_silent_at_the_stated_rate(folder: Path) -> None:
    """13 matrices by 30 days: none. At one false alarm in 5 matrices: at most four deviations above it."""
    log = axis(folder, "long", source={"log": folder / "long.parquet", "from": LEARNED_S})
    rows = livebode.Run(gantry_run(log, folder / "rest").directory).matrix
    baseline = livebode.Run(folder / "healthy").matrix
    silent = MatrixMonitor(baseline, description=GANTRY)
    assert silent.process(rows) == []
    often = MatrixMonitor(baseline, false_alarm_interval_s=5 * MEMORY * CYCLE / RATE_HZ)
    differing = sum(event.kind == "change" for event in often.process(rows))
    judged = often.judged_s * RATE_HZ / (MEMORY * CYCLE)
    assert judged > 11
    assert differing <= 0.2 * judged + 4 * np.sqrt(0.2 * 0.8 * judged)


def test_the_cut_of_the_samples_changes_no_event(folder: Path, weak: livebode.Run) -> None:
    configured = axis(folder, "weak", compared(folder))
    estimate, found = ResponseMatrix.of(configured, RATE_HZ), list[Event]()
    for block in livebode.open_log(folder / "weak.parquet").blocks(list(NAMES), block_samples=777):
        found += estimate.detection.process(estimate.tracker.process(block))
    assert found == changes(weak)


def test_a_stopped_run_continues_with_the_same_alarms(folder: Path, weak: livebode.Run, tmp_path: Path) -> None:
    """Stopped while the change is reported with its first amount."""
    first = changes(weak)[0].sample
    configured = axis(folder, "weak", compared(folder), record={"segment_s": 10.0})
    with pytest.raises(StopError):
        run(configured, Destination(tmp_path / "run", lambda *_: None, subscribers=(stopping(first + CYCLE),)))
    found = livebode.Run(gantry_run(configured, tmp_path / "run").directory)
    assert changes(found) == changes(weak)
    assert found.summary["monitoring"] == weak.summary["monitoring"]


def stopping(until: int) -> Any:
    def stop(document: Any) -> None:
        if getattr(document, "samples", 0) > until:
            raise StopError

    return stop


def test_the_dashboard_draws_the_baseline_of_an_entry(folder: Path, weak: livebode.Run) -> None:
    entry = livebode.Run(weak.path, entry="velocity2/u1")
    assert "gantry" not in entry.summary["configuration"]["monitoring"]
    _, healthy, remark = overlays_of(entry.summary, Quantities.of(entry.summary))
    assert healthy is not None, remark
    drawn = healthy.response(entry.responses[-1:], 0.0)
    assert drawn is not None
    expected = mean_matrix(livebode.Run(folder / "healthy").matrix).entry("velocity2", "u1")
    assert np.array_equal(drawn.value, expected.value)
    assert np.array_equal(drawn.sigma, expected.sigma)


def test_another_baseline_or_description_cannot_continue_it(folder: Path) -> None:
    baseline = livebode.Run(folder / "healthy").matrix
    monitor = MatrixMonitor(baseline, description=GANTRY)
    for other in (MatrixMonitor(baseline[:-1], description=GANTRY), MatrixMonitor(baseline, description=WEAK)):
        with pytest.raises(StateError, match="other settings"):
            other.restore(monitor.snapshot())


def test_each_axis_of_a_file_has_its_own_alarms(folder: Path, weak: livebode.Run, tmp_path: Path) -> None:
    """Relative to the file, as the command line reads it."""
    words = (
        'signals = { output = ["velocity1", "velocity2"], input = ["u1", "u2"], excitation = ["w1", "w2"] }\n'
        f'lines = {{ frequencies = "5:100:2.5", window = {LINES.window} }}\n'
        f"tracking = {{ hop = {LINES.window}, average = true }}\n"
        f"experiments = {{ dwell_periods = 3, settle_periods = 2, memory = {MEMORY} }}\n"
        'monitoring = { baseline = "healthy", gantry = "gantry.toml" }\n'
    )
    file = folder / "axes.toml"
    logs = {"one": 'log = "weak.parquet"', "two": f'log = "long.parquet"\nto = {LEARNED_S}'}
    file.write_text(words + "".join(f"[axes.{name}.source]\n{log}\n" for name, log in logs.items()))
    result = command("run", file, "--out", tmp_path / "runs", "--json")
    assert result.code == 0
    assert "one: velocity1/u1: the response drifts during the recording" in result.err  # the belt, meanwhile
    assert "two:" not in result.err
    found = json.loads(result.out)["axes"]
    assert found["one"]["monitoring"]["alarms"] == weak.summary["monitoring"]["alarms"]
    assert found["two"]["monitoring"]["changes"] == 0
    assert found["two"]["monitoring"]["message"].startswith("No change against the baseline (")


def test_without_a_baseline_the_run_says_what_is_missing(folder: Path, tmp_path: Path) -> None:
    alone = axis(folder, "weak", {"gantry": folder / "gantry.toml", "false_alarm_interval_days": 2.0})
    found = gantry_run(alone, tmp_path / "run").summary["monitoring"]
    assert found["message"] == (
        "Without a baseline no change can be detected; monitoring.baseline specifies a run of the healthy machine. "
        "false_alarm_interval_days = 2 has no effect without one. monitoring.gantry has no effect without one."
    )


def test_covariates_belong_to_a_single_response() -> None:
    with refused(ConfigError, "key-conflict", key="monitoring.covariates"):
        axis(Path(), "log", {"covariates": ["temperature"]})


def test_a_gantry_is_refused_for_a_single_response() -> None:
    words = {"source": {"log": "a.csv"}, "signals": {"output": "y", "input": "u"}, "monitoring": {"gantry": "g.toml"}}
    with refused(ConfigError, "key-conflict", key="monitoring.gantry"):
        Axis.of(words, "test")


@pytest.mark.parametrize(
    ("sections", "kind", "message"),
    [
        ({"monitoring": {"baseline": Path("nowhere")}}, BaselineError, "there is no baseline 'nowhere'"),
        ({"monitoring": {"baseline": Path("gantry.toml")}}, BaselineError, "is not a baseline of a matrix"),
        ({"monitoring": {"baseline": Path("healthy"), "gantry": Path("odd.toml")}}, UsageError, "no parameter 'mass'"),
        ({"lines": {"frequencies": "5:95:2.5", "window": LINES.window}}, BaselineError, "has the lines 5, 7.5,"),
        ({"tracking": {"estimator": "direct", "average": True}}, BaselineError, "has the estimator joint"),
        ({"tracking": {"hop": LINES.window}}, ConfigError, "set experiments.memory to 4 or more"),
        (
            {"signals": {"output": "velocity1", "input": ["u1", "u2"], "excitation": ["w1", "w2"]}},
            BaselineError,
            "has the outputs velocity1, velocity2, and this run has velocity1",
        ),
    ],
)
def test_what_does_not_fit_is_refused_at_the_start(
    folder: Path, sections: dict[str, Any], kind: type[LivebodeError], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    Path("odd.toml").write_text("mass = 1\n")
    configured = axis(folder, "weak", **({"monitoring": {"baseline": Path("healthy")}} | sections))
    with pytest.raises(kind, match=message):
        ResponseMatrix.of(configured, RATE_HZ)


def test_another_configuration_continues_the_alarms_of_the_same_baseline(folder: Path, weak: livebode.Run) -> None:
    """A live axis whose [report] was edited: what was reported is not reported again."""
    configured = axis(folder, "weak", compared(folder))
    before, after, other = (
        ResponseMatrix.of(one, RATE_HZ)
        for one in (configured, configured, axis(folder, "weak", compared(folder, false_alarm_interval_days=1.0)))
    )
    before.detection.process(weak.matrix)
    for estimate in (after, other):
        assert estimate.take_over(before)
    assert after.detection.summary() == before.detection.summary()
    assert other.detection.summary()["changes"] == 0


def test_the_recipe_counts_a_gantry_by_its_content(folder: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy.toml"
    copy.write_bytes((folder / "gantry.toml").read_bytes())
    here, there = (axis(folder, "weak", compared(folder, gantry=file)) for file in (folder / "gantry.toml", copy))
    assert recipe_id(here) == recipe_id(there)
    copy.write_text("cart_kg = 6\n")
    assert recipe_id(here) != recipe_id(there)
