"""Changes of the simulated axis against a learned model: found, named, sized, placed; and what is no change."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.monitoring import Evidence, MachineDetector
from livebode.simulation import DampingGrowth, LoadChange, Mechanics, Sensor, SoftSpot, TensionLoss
from tests.support.monitored import BACK, changed, changes_of, machine, recorded, watcher


def test_the_learned_model_is_the_machine() -> None:
    learned, truth, x = machine(), Mechanics(), np.linspace(0.3, 1.55, 20)
    assert abs(learned.model.inertia_kg_m2 / truth.inertia_kg_m2 - 1) < 0.001
    assert abs(learned.model.load_kg / truth.load_kg - 1) < 0.001
    assert np.max(np.abs(learned.model.stiffness_at(x) / truth.stiffness_at(x) - 1)) < 0.002
    assert np.max(np.abs(learned.model.damping_at(x) / truth.damping_at(x) - 1)) < 0.02
    assert learned.noise_power == pytest.approx(400 * 0.1**2, rel=0.2)


@pytest.mark.parametrize(
    ("fault", "what", "percent"),
    [
        (TensionLoss(start_s=6.0, loss=0.005), "stiffness", -0.5),
        (TensionLoss(start_s=6.0, loss=0.1), "stiffness", -10.0),
        (LoadChange(start_s=6.0, load_kg=0.134), "load", 2.0),
        (DampingGrowth(start_s=6.0, factor=1.2), "damping", 20.0),
    ],
    ids=["0.5 % of stiffness", "10 % of stiffness", "2 % of load", "20 % of damping"],
)
def test_a_change_is_found_named_and_sized(fault: object, what: str, percent: float) -> None:
    monitor = watcher()
    events = monitor.process(recorded((0.25, 0.3), fault, seed=3)) + monitor.finish()
    assert changes_of(events) == [("change", what)]
    details = events[0].details
    assert abs(details["amount_percent"] - percent) < max(2 * details["bound_percent"], 0.05 * abs(percent))
    assert abs(details["since_s"] - 6.0) < 0.5
    assert details["since_earliest_s"] <= 6.0 <= details["since_latest_s"]
    assert events[0].time_s < 6.0 + 5.4  # a stroke at this speed
    assert monitor.standing()[0]["what"] == what


@pytest.mark.parametrize("ends", [BACK, BACK[::-1]], ids=["back", "there"])
def test_a_soft_spot_is_located_and_its_alarm_remains_active(ends: tuple[float, float]) -> None:
    spot = SoftSpot(position_m=1.1, width_m=0.0777, loss=0.1)
    events = watcher().process(recorded((0.3, 0.35, 0.2), spot, seed=4, ends=ends))
    assert changes_of(events) == [("change", "stiffness")]
    assert abs(events[0].details["place_m"] - 1.1) < 0.02
    assert "around position 1.1" in events[0].message


def test_a_ramp_is_found_early() -> None:
    """At one percent of its stiffness a minute, the alarm comes before two thirds of a percent have gone."""
    events = watcher().process(recorded((0.3,) * 10, TensionLoss(loss=0.01, ramp_s=60.0), seed=5))
    assert changes_of(events) == [("change", "stiffness")]
    assert events[0].time_s < 40.0


def test_an_alarm_clears_once_when_the_load_is_removed() -> None:
    """A load that is picked up and put down again: one alarm, one that it has gone."""
    load = LoadChange(start_s=5.0, load_kg=0.1), LoadChange(start_s=20.0, load_kg=-0.1)
    events = watcher().process(recorded((0.3,) * 8, *load, seed=6))
    assert changes_of(events) == [("change", "load"), ("change-cleared", "load")]
    assert 20.0 < events[1].time_s < 22.0


def test_speed_and_direction_are_no_change() -> None:
    """Slow, fast, there and back: a baseline of one speed would fake one to two percent."""
    fast, slow = 0.98 * machine().fastest_m_per_s, 1.02 * machine().slowest_m_per_s
    for seed, ends in enumerate((BACK, BACK[::-1])):
        assert changes_of(watcher().process(recorded((fast, slow, fast, 0.2), seed=20 + seed, ends=ends))) == []


def test_noise_and_excitation_are_no_change() -> None:
    """Noise three times as loud from the middle on, and an excitation a third as strong."""
    block = recorded((0.3, 0.3, 0.3), seed=7)
    generator = np.random.default_rng(1)

    def louder(data: np.ndarray) -> None:
        half = data.shape[1] // 2
        data[2, half:] += 0.28 * generator.standard_normal(data.shape[1] - half)

    assert changes_of(watcher().process(changed(block, louder))) == []
    loud = recorded((0.3, 0.3), seed=8, sensor=Sensor(noise_rad_per_s=0.4))
    assert changes_of(watcher().process(loud)) == []


def test_speeds_and_positions_that_were_not_learned_are_not_judged_and_reported_once() -> None:
    fast = watcher()
    assert changes_of(fast.process(recorded((1.2, 1.2), seed=9))) == [("baseline-unknown", "fast")]
    assert fast.detector.judged < 10  # at the ends of the strokes
    beyond = recorded((0.3, 0.3), seed=10)

    def moved(data: np.ndarray) -> None:
        data[3] += 0.4

    assert ("baseline-unknown", "place") in changes_of(watcher().process(changed(beyond, moved)))


def test_standstill_and_creeping_are_not_judged() -> None:
    monitor = watcher()
    block = recorded((0.02,), seed=11).cut(0, 80000)
    assert monitor.process(block) == []
    assert monitor.detector.judged == 0


def test_false_alarms_are_rarer_than_asked_for() -> None:
    """Synthetic windows with the learned information, many short waits: alarms against those that were allowed."""
    generator, learned = np.random.default_rng(0), machine()
    monitor, kept = watcher(), []
    monitor.process(recorded((0.3, 0.3), seed=12), kept.append)
    seen = Evidence.join(kept)
    seen = seen[seen.judged]
    factor = np.linalg.cholesky(seen.information)
    windows_between, alarms, windows = 300, 0, 0
    detector = MachineDetector(learned, float(np.log(windows_between * 10)))
    for _ in range(60):
        noise = generator.standard_normal(seen.score.shape)
        made = Evidence(**(vars(seen) | {"score": np.einsum("rjk,rk->rj", factor, noise)}))
        windows += len(made)
        if detector.process(made) or detector.standing.alarms:
            alarms += 1
            detector = MachineDetector(learned, float(np.log(windows_between * 10)))
    assert windows > 3000
    assert alarms <= windows / windows_between


def test_another_machine_is_reported_as_such() -> None:
    """79 % more inertia and mass: no single change is named for it, and an amount that is told covers the truth."""
    truth, healthy = {"inertia": 0.005, "load": 12.0}, Mechanics()
    percent = {
        "inertia": 100 * (truth["inertia"] / healthy.inertia_kg_m2 - 1),
        "load": 100 * (truth["load"] / healthy.load_kg - 1),
    }
    other = Mechanics(inertia_kg_m2=truth["inertia"], load_kg=truth["load"])
    monitor = watcher()
    events = monitor.process(recorded((0.3,) * 5, seed=71, mechanics=other)) + monitor.finish()
    first, *rest = [e for e in events if e.kind == "change"]
    assert (first.details["what"], first.details["amount_percent"]) == ("machine", None)
    assert "may be another machine" in first.message
    assert first.time_s < 5
    assert {e.details["what"] for e in rest} <= set(percent)
    for details in [e.details for e in rest] + [s for s in monitor.standing() if s["what"] != "machine"]:
        assert abs(details["amount_percent"] - percent[details["what"]]) < details["bound_percent"]


def test_two_changes_at_once_are_reported_together() -> None:
    """The first name takes the second's part, and is corrected once that has a name too."""
    faults = TensionLoss(start_s=6.0, loss=0.04), LoadChange(start_s=6.0, load_kg=0.335)
    truth, monitor = {"stiffness": -4.0, "load": 5.0}, watcher()
    events = monitor.process(recorded((0.3, 0.33, 0.3, 0.3), *faults, seed=71)) + monitor.finish()
    kinds = changes_of(events)
    assert sorted(k for k in kinds if k[0] == "change") == [("change", "load"), ("change", "stiffness")]
    assert [k for k in kinds if k[0] == "change-corrected"] == [("change-corrected", kinds[0][1])]
    for details in [e.details for e in events[1:]] + monitor.standing():
        assert abs(details["amount_percent"] - truth[details["what"]]) < max(2 * details["bound_percent"], 0.1)
    for details in monitor.standing():
        assert f"{abs(details['amount_percent']):.1f}" in "; ".join(monitor.together())
