"""Runs that differ from each other without a sensor for the reason: what is still seen, and what is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from livebode.core import Block, Event
from livebode.monitoring import DEFAULT_INTERVAL_S, Evidence, LearnedMachine, MachineDetector, MachineMonitor
from livebode.monitoring.accuracy import ChangeAccuracy
from livebode.monitoring.between_runs import BetweenRuns, RunOffset, between_runs, chance
from livebode.monitoring.charts import Charts
from livebode.monitoring.evidence import JUDGED
from livebode.simulation import TensionLoss
from tests.support.axes import LINES
from tests.support.monitored import NAMES, ideal
from tests.support.warm import at_temperature, judged

SMALLEST = np.array([0.005, 0.005, 0.05, 0.01])
BELT = BetweenRuns(np.array([-0.005, 0.0, 0.0, 0.0]), spread=2.0)


def without_sensor() -> LearnedMachine:
    """The axis as it is, as learned from runs whose stiffness scatters by 1 %."""
    return replace(ideal(), between=BELT)


def changes(events: list[Event]) -> list[str]:
    return [str(event.details["what"]) for event in events if event.kind == "change"]


def windows(generator: np.random.Generator, offset: np.ndarray, count: int = 240) -> Evidence:
    """Evidence of a machine that is off its baseline by so much."""
    root = generator.standard_normal((count, 4, 8)) * (2.0 / SMALLEST)[:, np.newaxis]
    information = root @ root.swapaxes(1, 2) / 8
    noise = np.einsum("rjk,rk->rj", np.linalg.cholesky(information), generator.standard_normal((count, 4)))
    none = np.zeros((count, 0))
    return Evidence(
        score=information @ offset + noise, information=information, power=none, quiet_power=none,
        position_m=np.zeros(count), speed_m_per_s=np.ones(count), time_s=np.arange(count) / 10,
        sample=np.arange(count), status=np.full(count, JUDGED), late_score=np.zeros(count),
        late_information=np.zeros((count, 5)), ripple_score=none, ripple_information=np.zeros((count, 0, 0)),
        ripple_gain=np.zeros((count, 0, 1)), covariate=none, amplitude=none, swing=np.zeros(count),
    )  # fmt: skip


def test_the_direction_in_which_runs_differ_is_found_with_its_spread() -> None:
    generator = np.random.default_rng(1)
    direction = np.array([0.005, 0.001, 0.0, 0.0])
    parts = [windows(generator, amount * direction) for amount in generator.normal(0.0, 1.5, 8)]
    found = between_runs(parts, SMALLEST)
    assert found is not None
    assert found.direction / found.direction[0] * 0.005 == pytest.approx(direction, abs=4e-4)
    assert found.spread == pytest.approx(1.5, rel=0.5)


@pytest.mark.parametrize(("runs", "size"), [(5, 0.0), (5, 0.15), (1, 3.0)])
def test_runs_that_do_not_differ_or_hardly_have_none(runs: int, size: float) -> None:
    """Of 30 baselines of healthy runs; by chance one in 10,000 would have one."""
    generator = np.random.default_rng(2)
    for _ in range(30):
        offsets = size * SMALLEST * np.array([1, 0, 0, 0]) * generator.uniform(-1.7, 1.7, (runs, 1))
        assert between_runs([windows(generator, offset, 72) for offset in offsets], SMALLEST) is None


@pytest.mark.parametrize(("runs", "count"), [(2, 240), (3, 72), (5, 48)])
def test_too_few_runs_or_stretches_show_no_direction(runs: int, count: int) -> None:
    generator = np.random.default_rng(4)
    parts = [windows(generator, offset * SMALLEST, count) for offset in np.linspace(-5.0, 5.0, runs)]
    assert between_runs(parts, SMALLEST) is None


@pytest.mark.parametrize(("between", "within"), [(2, 10), (4, 70)])
def test_a_direction_chosen_by_the_noise_exceeds_its_bound_no_more_often_than_stated(between: int, within: int) -> None:
    """5,000 pairs of Wishart matrices without a difference; the bound of the fraction is four standard deviations."""
    generator, draws, level = np.random.default_rng(5), 5000, 0.01
    among, noise = (generator.standard_normal((draws, degrees, 4)) for degrees in (between, within))
    ratios = np.linalg.solve(noise.swapaxes(1, 2) @ noise, among.swapaxes(1, 2) @ among)
    roots = np.linalg.eigvals(ratios).real
    limit = level + 4 * np.sqrt(level / draws)
    assert np.mean([chance(root, between, within) < level for root in roots.max(axis=1)]) < limit
    wilks = np.prod(1 + roots, axis=1) - 1
    assert np.mean([chance(ratio, between, within) < level for ratio in wilks]) == pytest.approx(
        level, abs=limit - level
    )


def test_projected_evidence_is_independent_of_the_offset() -> None:
    seen = windows(np.random.default_rng(3), np.array([0.02, 0.0, 0.0, 0.03]), 2000)
    between = BetweenRuns(np.array([0.005, 0.0, 0.0, 0.0]), 1.0)
    score, information = between.projected(seen.score, seen.information, SMALLEST)
    assert not score[:, 0].any()
    assert not information[:, 0].any()
    free = np.linalg.inv(np.linalg.inv(seen.information)[:, 1:, 1:])
    assert information[:, 1:, 1:] == pytest.approx(free)
    found = np.linalg.solve(information[:, 1:, 1:].sum(axis=0), score[:, 1:].sum(axis=0))
    assert found == pytest.approx([0.0, 0.0, 0.03], abs=2e-3)


def test_windows_without_information_are_projected_to_none_and_charts_refuse_what_is_no_number() -> None:
    score, information = BELT.projected(np.zeros((1, 4)), np.zeros((1, 4, 4)), SMALLEST)
    assert not score.any()
    assert not information.any()
    with pytest.raises(ValueError, match="not a number"):
        Charts(SMALLEST, np.zeros(4), 20.0).step(np.full(4, np.nan), np.ones(4), 0)


def test_a_loss_is_found_in_a_run_that_begins_without_torque() -> None:
    statuses: list[str] = []
    monitor, events = MachineMonitor(without_sensor(), LINES, NAMES, DEFAULT_INTERVAL_S), []
    for block in at_temperature(4.0, 20_000, TensionLoss(loss=0.01, start_s=5.0), seconds=8.0)():
        data = block.data.copy()
        data[block.index("u"), : max(2 * 4000 - block.start, 0)] = 0.0
        still = Block(data, block.channels, block.rate_hz, start=block.start)
        events += monitor.process(still, lambda seen: statuses.extend(seen.status))
    assert "unexcited" in statuses
    assert changes(events + monitor.finish()) == ["stiffness"]


def test_an_offset_is_followed_and_forgotten_after_a_pause() -> None:
    held = ChangeAccuracy(np.ones(4), np.zeros(4), SMALLEST)
    own, information = RunOffset(BELT, held, 20.0), np.diag(60.0 / SMALLEST**2)
    for mark in range(30):
        assert own.known == (mark >= 2)
        own.step(information @ (1.2 * BELT.direction), information, mark, mark / 10)
        own.settle(mark + 1, idle=True)
    assert own.reference == pytest.approx(1.2 * BELT.direction, rel=1e-2)
    own.step(information @ BELT.direction, information, 31, 3.0 + 61.0)
    assert not own.known


def test_windows_that_wait_for_longer_than_an_alarm_looks_back_enter_the_offset() -> None:
    own, information = (
        RunOffset(BELT, ChangeAccuracy(np.ones(4), np.zeros(4), SMALLEST), 20.0),
        np.diag(60.0 / SMALLEST**2),
    )
    for mark in range(610):
        own.step(information @ (0.2 * BELT.direction), information, mark, mark / 10)
        own.settle(0, idle=True)
    assert own.reference == pytest.approx(0.2 * BELT.direction, rel=1e-2)


def test_a_chart_of_a_cell_that_the_cart_has_left_does_not_keep_the_offset_from_following() -> None:
    detector, known = MachineDetector(without_sensor(), 24.0), np.diag(60.0 / SMALLEST**2)
    for stretch in range(34):
        off = np.full((10, 1), (0.1 if stretch else 0.0) * BELT.direction[0])
        position_m = np.full(10, 1.0)
        if stretch == 1:
            off[0], position_m[0] = 0.8 * BELT.direction[0], 0.5
        seen = windows(np.random.default_rng(7), np.zeros(4), 10)
        score = (off * [1, 0, 0, 0] - detector.offset.logarithms) @ known
        time_s, information = np.arange(10) / 10 + stretch, np.tile(known, (10, 1, 1))
        seen = replace(seen, score=score, information=information, position_m=position_m, time_s=time_s)
        assert detector.process(seen) == []
    assert detector.offset.logarithms[0] == pytest.approx(0.1 * BELT.direction[0], rel=0.1)


@pytest.mark.parametrize(("information", "reports"), [(0.1, 1), (1.0, 0)])
def test_an_offset_that_remains_uncertain_is_reported_once(information: float, reports: int) -> None:
    """600 windows, each with so much information on a smallest change: 0.16 of it would tell a tenth at last."""
    generator, detector = np.random.default_rng(6), MachineDetector(without_sensor(), 24.0)
    known, root = np.diag(information / SMALLEST**2), np.sqrt(information) / SMALLEST
    events = []
    for _ in range(60):
        noise = generator.standard_normal((10, 4)) * root
        seen = windows(generator, np.zeros(4), 10)
        score = noise - known @ detector.offset.logarithms
        events += detector.process(replace(seen, score=score, information=np.tile(known, (10, 1, 1))))
    offsets = [event for event in events if event.kind == "baseline-unknown"]
    assert [event.details["reason"] for event in offsets] == ["offset"] * reports
    if reports:
        assert "determine its own offset only to ± 0.072 %" in offsets[0].message
        assert "the belt's stiffness" in offsets[0].message
        assert "detected only beyond 3 % from the baseline" in offsets[0].message


def test_a_healthy_run_at_another_temperature_raises_no_alarm_nor_does_what_temperature_explains() -> None:
    assert judged(without_sensor(), at_temperature(4.0, 20_000, seconds=6.0)()) == []
    lost = at_temperature(-1.0, 20_000, TensionLoss(loss=0.01), seconds=6.0)
    assert judged(without_sensor(), lost()) == [], "a belt 5 K warmer is the same"


def test_a_stiffness_lost_within_the_run_is_found_and_dated() -> None:
    events = judged(without_sensor(), at_temperature(4.0, 20_000, TensionLoss(loss=0.01, start_s=5.0), seconds=8.0)())
    assert changes(events) == ["stiffness"]
    assert events[0].details["since_s"] == pytest.approx(5.0, abs=0.3)
    assert events[0].message.endswith("than before in this run.")


def test_a_loss_within_the_run_clears_to_what_the_run_was_before() -> None:
    detector, known, events = MachineDetector(without_sensor(), 24.0), np.diag(60.0 / SMALLEST**2), []
    for stretch in range(30):
        off = BELT.direction * (1.0 + 4.0 * (10 <= stretch < 20))
        seen = windows(np.random.default_rng(8), np.zeros(4), 10)
        score = np.tile(known @ (off - detector.offset.logarithms), (10, 1))
        time_s, position_m = np.arange(10) / 10 + stretch, np.linspace(0.4, 1.4, 10)
        information = np.tile(known, (10, 1, 1))
        seen = replace(seen, score=score, information=information, position_m=position_m, time_s=time_s)
        events += detector.process(seen)
    assert [event.kind for event in events] == ["change", "change-cleared"]
    assert [event.details["reference"] for event in events] == ["run", "run"]
    assert "is as before in this run again" in events[1].message


def test_a_loss_of_inertia_from_the_beginning_is_found_whatever_the_temperature() -> None:
    events = judged(without_sensor(), at_temperature(4.0, 20_000, inertia=0.98, seconds=6.0)())
    assert changes(events) == ["inertia"]
    assert events[0].details["amount_percent"] == pytest.approx(-2.0, abs=0.5)


def test_a_stiffness_beyond_that_of_any_healthy_run_is_found_from_the_beginning() -> None:
    events = judged(without_sensor(), at_temperature(0.0, 20_000, TensionLoss(loss=0.05), seconds=6.0)())
    assert changes(events) == ["stiffness"]
    assert events[0].details["amount_percent"] == pytest.approx(-5.0, abs=0.5)
    assert events[0].message.endswith("than in the baseline.")


def test_cut_and_restored_anywhere_the_events_are_the_same() -> None:
    blocks = list(at_temperature(4.0, 20_000, TensionLoss(loss=0.01, start_s=5.0), seconds=7.0)())
    assert len(blocks) == 1
    pieces = [blocks[0].cut(at, at + 3333) for at in range(0, len(blocks[0]), 3333)]
    monitor, events = MachineMonitor(without_sensor(), LINES, NAMES, DEFAULT_INTERVAL_S), []
    for piece in pieces:
        events += monitor.process(piece)
        snapshot = monitor.snapshot()
        monitor = MachineMonitor(without_sensor(), LINES, NAMES, DEFAULT_INTERVAL_S)
        monitor.restore(snapshot)
    events += monitor.finish()
    assert changes(events) == ["stiffness"]
    assert events == judged(without_sensor(), blocks)
