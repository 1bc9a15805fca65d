"""The interval of a date contains the true beginning: of steps and ramps, strong and weak, at places and in pauses."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.monitoring.change_date import ChangeDate, date_of, independent, rows_of
from livebode.simulation import LoadChange, TensionLoss
from tests.support.axes import MULTISINE
from tests.support.monitored import changes_of, recorded, watcher

WINDOW_S = 0.1


def date(begin_s: float, ramp_s: float, size: float, seed: int, *, offset: float = 0.0) -> ChangeDate:
    """Of 30 s of windows whose information is one standard deviation, with a change of `size` of them."""
    generator, rows = np.random.default_rng(seed), 260
    end_s = WINDOW_S * np.arange(1, rows + 1)
    step_s = np.clip(end_s - begin_s, 0.0, WINDOW_S) / WINDOW_S
    share = np.clip((end_s - begin_s) / ramp_s, 0.0, 1.0) if ramp_s else step_s
    information = generator.uniform(0.2, 1.8, (rows, 1))
    amount = (offset + size * share)[:, np.newaxis]
    score = information * amount + np.sqrt(information) * generator.standard_normal((rows, 1))
    found = rows_of(score, information, end_s - WINDOW_S / 2, np.array([abs(offset)]))
    return date_of(found, end_s - WINDOW_S / 2, list(range(rows)), healthy_before=True)


@pytest.mark.parametrize("offset", [0.0, 0.3])
def test_the_interval_contains_the_beginning_in_95_of_100_cases(offset: float) -> None:
    """120 steps and ramps; fewer than 108 would be seen in one of 100 such tests if 95 % were true."""
    generator, covered, widths = np.random.default_rng(11), 0, []
    for seed in range(120):
        begin_s, size = float(generator.uniform(10.0, 22.0)), float(generator.choice([1.0, 2.0, 6.0]))
        ramp_s = float(generator.choice([0.0, 0.0, 0.7, 4.0]))
        found = date(begin_s, ramp_s, size, seed, offset=offset)
        assert found.earliest_s is not None
        covered += found.earliest_s <= begin_s <= found.latest_s
        if size == 6.0 and not ramp_s:
            widths.append(found.latest_s - found.earliest_s)
    assert covered >= 108
    assert np.median(widths) < 6 * WINDOW_S


def test_correlated_directions_become_independent_ones_with_the_same_evidence() -> None:
    generator = np.random.default_rng(2)
    root = generator.standard_normal((4, 4))
    known = np.tile(root @ root.T, (50, 1, 1))
    score = generator.standard_normal((50, 4))
    own, information = independent(score, known)
    total = score.sum(axis=0)
    assert np.sum(own.sum(axis=0) ** 2 / information.sum(axis=0)) == pytest.approx(
        total @ np.linalg.solve(known.sum(axis=0), total)
    )


def test_a_change_since_the_first_window_has_no_earliest_time() -> None:
    monitor = watcher()
    events = monitor.process(recorded((0.3, 0.3), TensionLoss(loss=0.02), seed=3)) + monitor.finish()
    (event,) = (e for e in events if e.kind == "change")
    assert event.details["since_earliest_s"] is None
    assert f"(at the latest {event.details['since_latest_s']:.2f} s)" in event.message


def test_an_alarm_of_another_machine_is_dated_too() -> None:
    faults = TensionLoss(start_s=7.0, loss=0.3), LoadChange(start_s=7.0, load_kg=5.4)
    monitor = watcher()
    events = monitor.process(recorded((0.3,) * 4, *faults, seed=71)) + monitor.finish()
    first = next(e for e in events if e.kind == "change")
    assert first.details["since_earliest_s"] <= 7.0 <= first.details["since_latest_s"]
    assert abs(first.details["since_s"] - 7.0) < 1.0
    assert f"(between {first.details['since_earliest_s']:.2f} s and" in first.message


@pytest.mark.parametrize("factor", [2.0, 5.0])
def test_a_stronger_excitation_than_learned_raises_no_alarm(factor: float) -> None:
    """Where the excitation reverses slow motion, dry friction looks like a tenth of damping."""
    events = watcher().process(recorded((0.15, 0.36, 0.13), seed=300, excitation_n_m=factor * MULTISINE))
    assert ("baseline-unknown", "amplitude") in changes_of(events)
    assert [e.message for e in events if e.kind == "change"] == []
    assert events[0].details["ratio"] == pytest.approx(factor, rel=0.1)


def test_a_weaker_excitation_than_learned_raises_no_alarm_and_finds_a_larger_change() -> None:
    monitor, loss = watcher(), TensionLoss(start_s=6.0, loss=0.03)
    events = monitor.process(recorded((0.3, 0.3, 0.3), loss, seed=301, excitation_n_m=0.1 * MULTISINE))
    (event,) = (e for e in events + monitor.finish() if e.kind == "change")
    assert event.details["what"] == "stiffness"
    assert event.details["since_earliest_s"] <= 6.0 <= event.details["since_latest_s"]
