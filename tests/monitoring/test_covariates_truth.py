"""What a healthy machine's parameters depend on, such as a temperature, is no change; what it does not explain is."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from livebode.analysis import learn
from livebode.configuration import Axis
from livebode.core import BaselineError, Block, Event
from livebode.monitoring import Baseline, LearnedMachine, MachineMonitor
from livebode.monitoring.covariates import Covariates, jackknife, parts_of, window_means, with_range
from livebode.runtime import Destination, run
from livebode.simulation import TensionLoss
from tests.support.axes import LINES
from tests.support.command import write_parquet
from tests.support.errors import refused
from tests.support.monitored import NAMES, ideal
from tests.support.warm import MEAN_C, PER_KELVIN, Run, at_temperature, judged

SHORT_S = 6.0


def warm() -> LearnedMachine:
    """The axis as it is, with its dependence on the temperature."""
    limits = np.array([MEAN_C - 2.5]), np.array([MEAN_C + 2.8])
    slope = np.array([[-PER_KELVIN], [0.0], [0.0], [0.0]])
    return replace(
        ideal(), covariates=Covariates(("temperature",), np.array([MEAN_C]), *limits, slope, np.zeros((4, 1, 1)))
    )


def changes(events: list[Event]) -> list[str]:
    return [str(event.details["what"]) for event in events if event.kind == "change"]


def edited(samples: Run, celsius: float, first: int = 0) -> list[Block]:
    """The blocks with another temperature from a sample on."""
    blocks = []
    for block in samples():
        data = block.data.copy()
        data[block.index("temperature"), max(first - block.start, 0) :] = celsius
        blocks.append(Block(data, block.channels, block.rate_hz, start=block.start))
    return blocks


def axis_of(log: Path, run: Run, **monitoring: object) -> Axis:
    """The configuration of a recording that is written there."""
    blocks = list(run())
    data = {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0].names}
    write_parquet(log, {"t": np.arange(len(data["u"])) / blocks[0].rate_hz} | data)
    signals = {"excitation": "w", "input": "u", "output": "velocity", "schedule": "x"}
    lines = {"frequencies": "20:140:20", "window": 400}
    sections = {"source": {"log": log}, "signals": signals, "lines": lines, "monitoring": monitoring}
    return Axis.of(sections, "the test")


def messages(axis: Axis, directory: Path) -> list[str]:
    """Sentences of the changes and of what is not judged."""
    run(axis, Destination(directory, lambda *_: None))
    happened = [json.loads(line) for line in (directory / "events.jsonl").read_text("utf-8").splitlines()]
    return [event["message"] for event in happened if event["kind"] in ("change", "baseline-unknown")]


def test_a_belt_that_softens_with_temperature_is_learned_and_only_a_loss_beyond_that_is_a_change(
    tmp_path: Path,
) -> None:
    healthy = [tmp_path / f"run{i}" for i in range(3)]
    for i, (directory, kelvin) in enumerate(zip(healthy, (-2.5, 0.0, 2.5))):
        log, samples = tmp_path / f"{i}.parquet", at_temperature(kelvin, 9000 + i, seconds=SHORT_S)
        assert messages(axis_of(log, samples, covariates=["temperature"]), directory) == []
    baseline = tmp_path / "healthy.json"
    learn(healthy).save(baseline)
    machine = Baseline.load(baseline).machine
    assert machine is not None
    assert machine.between is None
    assert machine.covariates.low[0] == pytest.approx(MEAN_C - 2.5, abs=0.2)
    off = machine.covariates.slope[:, 0] - [-PER_KELVIN, 0, 0, 0]
    assert np.all(np.abs(off) < 4 * np.sqrt(machine.covariates.covariance[:, 0, 0]) + 1e-5)

    log, samples = tmp_path / "warm.parquet", at_temperature(1.9, 20_004, seconds=SHORT_S)
    assert messages(axis_of(log, samples, baseline=baseline), tmp_path / "warm") == []
    lost = at_temperature(-2.2, 20_004, TensionLoss(loss=0.01), seconds=SHORT_S)
    found = messages(axis_of(log, lost, baseline=baseline), tmp_path / "lost")
    assert len(found) == 1
    assert "the belt's stiffness is 0.9 ± 0.2 % less than in the baseline" in found[0]
    with refused(BaselineError, "settings-differ", setting="covariates", learned=["temperature"], value=["x"]):
        run(axis_of(log, lost, baseline=baseline, covariates=["x"]), Destination(tmp_path / "other", lambda *_: None))


def test_a_temperature_that_was_not_learned_is_reported_and_not_judged() -> None:
    hot = at_temperature(8.0, 20_003, seconds=2.5)
    events = judged(warm(), hot())
    assert [event.kind for event in events] == ["baseline-unknown"]
    assert "The baseline covers 'temperature' from 19.5 to 24.8, but it is 30" in events[0].message
    events = judged(warm(), edited(hot, np.nan))
    assert [event.kind for event in events] == ["baseline-unknown"]
    assert "'temperature' has no value" in events[0].message


def test_a_sensor_that_fails_leaves_the_windows_before_it_judged() -> None:
    monitor = MachineMonitor(warm(), LINES, NAMES, 1e9)
    statuses: list[str] = []
    blocks = edited(at_temperature(2.2, 20_004, seconds=3.5), np.nan, first=2 * 4000 + 1800)
    for block in blocks:
        monitor.process(block, lambda seen: statuses.extend(seen.status))
    assert statuses.index("no covariate") == 25
    assert "judged" in statuses[15:24]


def test_a_temperature_that_never_changed_cannot_be_learned() -> None:
    with refused(BaselineError, "covariate-constant", channel="temperature", low=MEAN_C, high=MEAN_C):
        with_range(("temperature",), np.full((100, 1), MEAN_C))


def test_a_constant_temperature_with_noise_cannot_be_learned_and_a_small_range_beyond_it_can() -> None:
    generator = np.random.default_rng(3)
    noise = 0.0025 * generator.standard_normal((2000, 1))
    with refused(BaselineError, "covariate-constant", channel="temperature", high=pytest.approx(22.0, abs=0.01)):
        with_range(("temperature",), MEAN_C + noise)
    runs = np.repeat([-0.05, 0.0, 0.05], [600, 700, 700])[:, np.newaxis]
    assert with_range(("temperature",), MEAN_C + runs + noise).half_range[0] == pytest.approx(
        0.05 + 3.5 * 0.0025, abs=0.002
    )


def test_two_sensors_that_read_the_same_are_refused() -> None:
    value = np.linspace(18.0, 22.0, 100)[:, np.newaxis]
    with refused(BaselineError, "covariates-correlated", channels=["belt", "hall"]):
        with_range(("belt", "hall"), np.hstack([value, value + 3.0]))


def test_a_window_has_the_mean_of_the_samples_that_are_there() -> None:
    data = np.array([[1.0, np.nan, 3.0, np.nan, np.nan, np.nan]])
    means = window_means(data, np.array([0, 3]), 3)
    assert means[0, 0] == 2.0
    assert np.isnan(means[1, 0])


def test_a_slope_from_runs_with_offsets_is_as_uncertain_as_the_offsets_make_it() -> None:
    """Ordinary least squares over runs that share an offset each: its own covariance would be 50 times too small."""
    generator, size = np.random.default_rng(2), 50
    kelvin = np.repeat(np.linspace(-2, 2, 12), size)
    slopes, bounds = [], []
    for _ in range(60):
        value = 0.5 * kelvin + np.repeat(generator.normal(0.0, 1.0, 12), size) + generator.normal(0, 0.1, kelvin.size)
        parts = parts_of([size] * 12)
        left = [np.polyfit(np.delete(kelvin, part), np.delete(value, part), 1)[:1] for part in parts]
        slopes.append(np.polyfit(kelvin, value, 1)[0])
        bounds.append(np.sqrt(jackknife(np.array(left))[0, 0]))
    assert np.mean(bounds) == pytest.approx(np.std(slopes), rel=0.3)


def test_a_single_run_is_cut_into_five_parts() -> None:
    assert [part.size for part in parts_of([50])] == [10] * 5
