"""Friction and orders are compared with a baseline: healthy ones raise no alarm, changes are named."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from livebode.core import BaselineError, Block, Channel, Event
from livebode.estimation import Settings
from livebode.monitoring import DEFAULT_INTERVAL_S, Baseline, Monitor, TorqueMonitor, learn_torque
from livebode.monitoring.baseline_file import torque_plain
from livebode.motion import Shaft
from tests.support.monitored import pieces
from tests.support.stateful_cases import baseline
from tests.support.strokes import RATE_HZ, RIPPLE_N_M, SHAFTS, learned_torque, strokes

FROM_S = 30.0


def monitor(kind: str = "velocity") -> TorqueMonitor:
    return TorqueMonitor(learned_torque(kind), ("u", "y"), RATE_HZ, 3 * DEFAULT_INTERVAL_S)


def events(block: Block, kind: str = "velocity") -> list[Event]:
    judge = monitor(kind)
    return judge.process(block) + judge.finish()


@pytest.mark.parametrize("kind", ["velocity", "position"])
def test_healthy_strokes_at_other_speeds_raise_no_alarm(kind: str) -> None:
    """Twenty runs of 100 s each: one false alarm in 30 days is promised."""
    assert [e.message for seed in range(100, 120) for e in events(strokes(seed, kind=kind), kind)] == []


@pytest.mark.parametrize("kind", ["velocity", "position"])
@pytest.mark.parametrize("factor", [1.2, 1.5, 0.8])
def test_a_change_of_friction_is_named_in_both_directions_with_its_size_and_date(factor: float, kind: str) -> None:
    (found,) = events(strokes(1000, from_s=FROM_S, friction=factor, kind=kind), kind)
    assert found.kind == "change"
    assert found.details["what"] == "friction"
    assert found.time_s <= FROM_S + 30.0
    assert found.details["since_earliest_s"] <= FROM_S <= found.details["since_latest_s"]
    for change in found.details["changes"]:
        assert change["name"].startswith(("friction forward (", "friction backward ("))
        assert abs(change["amount"] - 100 * (factor - 1)) <= change["bound"]
        assert change["bound"] < 6.0


@pytest.mark.parametrize("ripple_n_m", [0.045, 0.06, 0.015])
def test_a_changed_ripple_is_named_by_its_order_with_its_amplitude(ripple_n_m: float) -> None:
    (found,) = events(strokes(1001, from_s=FROM_S, ripple_n_m=ripple_n_m))
    assert found.details["what"] == "orders"
    change = found.details["changes"][0]
    assert change["name"] == "order 6 of the motor"
    assert abs(change["amount"] - ripple_n_m) <= change["bound"] < 0.003
    assert change["baseline"] == pytest.approx(RIPPLE_N_M, rel=0.03)
    assert found.details["since_earliest_s"] <= FROM_S <= found.details["since_latest_s"]


def test_a_worn_tooth_is_found_by_all_its_orders_together() -> None:
    """Once a turn 0.02 N m: no order is larger than 1.6 mN m, less than an order alone must be."""
    smallest = min(learned_torque().smallest["orders"].values())
    assert smallest > 0.0016
    for seed in (1002, 1003):
        found = [e for e in events(strokes(seed, from_s=FROM_S, tooth_n_m=0.02)) if e.kind == "change"]
        assert found[0].details["changes"][0]["name"] == "all orders of the motor"


def test_what_disappears_again_is_cleared() -> None:
    ill, well = strokes(1004, friction=1.5, seconds=60.0), strokes(1005, seconds=60.0)
    judge = monitor()
    found = judge.process(ill) + judge.process(replace(well, start=ill.stop)) + judge.finish()
    assert [e.kind for e in found] == ["change", "change-cleared"]
    assert found[1].message == f"At {found[1].time_s:.1f} s the friction agrees with the baseline again."


def test_runs_with_different_friction_widen_the_smallest_change() -> None:
    """Friction of 0.9, 1.0 and 1.1 from run to run is not reported as a change, and +15 % is then none either."""
    runs = [strokes(seed, friction=f) for seed, f in zip((1, 2, 3), (0.9, 1.0, 1.1))]
    wide = learn_torque(
        [(lambda block=block: iter([block])) for block in runs], input="u", output="y", kind="velocity",
        lines_hz=np.zeros(0), shafts=SHAFTS,
    )  # fmt: skip
    assert min(wide.smallest["friction_percent"].values()) > 50
    judge = TorqueMonitor(wide, ("u", "y"), RATE_HZ, 3 * DEFAULT_INTERVAL_S)
    assert judge.process(strokes(4, friction=1.15)) == []


def test_the_events_do_not_depend_on_cuts_or_snapshots() -> None:
    block = strokes(1006, from_s=FROM_S, friction=1.5, ripple_n_m=0.06)
    whole, judge, cut = events(block), monitor(), []
    assert sorted(str(e.details["what"]) for e in whole) == ["friction", "orders"]
    for part in pieces(block, [1, 7001, 23, 20000]):
        cut += judge.process(part)
        following = monitor()
        following.restore(judge.snapshot())
        judge = following
    assert [(e.kind, e.sample, e.message) for e in cut] == [(e.kind, e.sample, e.message) for e in whole]


def test_a_gap_or_a_bad_sample_costs_its_section_alone() -> None:
    judge = monitor()
    judge.process(strokes(1007, gap_s=45.0))
    assert judge.summary()["friction"]["judged_s"] == 90.0


def test_a_baseline_keeps_friction_and_orders_and_an_older_one_has_none(tmp_path: Path) -> None:
    plain = baseline(by_model=False)
    learned = replace(plain, torque=learned_torque())
    assert plain.id != learned.id
    for one in (plain, learned):
        one.save(tmp_path / "healthy.json")
        assert Baseline.load(tmp_path / "healthy.json").id == one.id
    again = Baseline.load(tmp_path / "healthy.json").torque
    assert again is not None
    judge = TorqueMonitor(again, ("u", "y"), RATE_HZ, 3 * DEFAULT_INTERVAL_S)
    block = strokes(1000, from_s=FROM_S, friction=1.2)
    assert [e.message for e in judge.process(block)] == [e.message for e in events(block)]


def test_too_few_strokes_are_refused_with_what_is_needed() -> None:
    with pytest.raises(BaselineError, match=r"contain 5 sections of 10 s with strokes, less than the 8"):
        learn_torque(
            [lambda: iter([strokes(1, seconds=50.0)])], input="u", output="y", kind="velocity", lines_hz=np.zeros(0)
        )


def _without_excitation(block: Block) -> tuple[Monitor, list[Event]]:
    """A monitor by model and by friction and orders after these strokes, and its events."""
    channels = tuple(Channel(name, c.unit) for name, c in zip(("u", "velocity"), block.channels))
    still = np.zeros((2, len(block)))
    names = (*channels, Channel("w", "N m"), Channel("x", "m"))
    whole = Block(np.concatenate([block.data, still]), names, RATE_HZ)
    plain = baseline(by_model=True)
    lines = replace(plain.lines, rate_hz=RATE_HZ)
    learned = replace(plain, lines=lines, torque=learned_torque())
    settings = Settings(lines=lines, hop=plain.hop, output="velocity", input="u", excitation="w", schedule="x")
    judge = Monitor(learned, settings)
    return judge, judge.process_samples(whole) + judge.finish()


def test_friction_is_judged_where_the_model_cannot_judge_anything() -> None:
    """Without excitation the windows show nothing of the machine; the strokes still show its friction."""
    judge, found = _without_excitation(strokes(1008, from_s=FROM_S, friction=1.5))
    assert [e.details["what"] for e in found if e.kind == "change"] == ["friction"]
    summary = judge.summary()
    assert summary["standing"] == ["friction"]
    assert summary["judged_s"] == 0.0
    assert summary["torque"]["friction"]["judged_s"] == 100.0
    assert summary["message"].startswith("1 change against the baseline, 1 of them active at the end")
    assert "Friction and orders judged in 100 s." in summary["message"]


def test_the_result_does_not_say_that_nothing_was_judged_where_friction_was() -> None:
    judge, found = _without_excitation(strokes(1009))
    assert not [e for e in found if e.kind == "change"]
    message = judge.summary()["message"]
    assert message.startswith("No response could be judged: ")
    assert "Friction and orders judged in 100 s." in message


def test_a_baseline_file_has_the_variances_of_48_orders_and_no_matrix_of_them() -> None:
    """The matrix of 49 × 49 in each direction was 200 kB, of which the diagonal was used."""
    shafts = (Shaft("motor", 1.0, tuple(range(1, 49))),)
    runs = [lambda seed=seed: iter([strokes(seed)]) for seed in (1, 2)]
    learned = learn_torque(
        runs, input="u", output="y", kind="velocity", lines_hz=np.zeros(0), shafts=shafts
    )  # fmt: skip
    assert len(json.dumps(torque_plain(learned))) < 40_000
