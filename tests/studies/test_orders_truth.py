"""Orders over the angle: a known ripple within its bounds, told from lines of the time, and played back by a drive."""

from __future__ import annotations

import itertools
import json
import subprocess
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from livebode.arrays import Complex
from livebode.core import Block, Channel, SignalError, UsageError
from livebode.interface import write_examples
from livebode.motion import Shaft, Stroke
from livebode_control.strokes.angle_table import write_angle_table
from livebode_control.strokes.motion_samples import MotionSamples
from livebode_control.strokes.order_changes import order_changes
from livebode_control.strokes.orders import OrderReport, orders_of
from livebode_control.strokes.shaft_orders import ShaftOrders
from livebode_control.strokes.time_lines import time_lines
from studies.friction import SLIDING
from studies.friction import truth as friction_truth
from studies.orders import CASES, ECCENTRIC, SHAFT, measured, truth
from tests.support.command import livebode
from tools.structured_text import Machine

RATE_HZ = 1000.0
INERTIA, RIPPLE = 0.005, 0.05
SHAFTS = (Shaft("motor", 1.0, (1, 6, 7)), Shaft("pinion", 1.5, (1, 3)))


@cache
def _speed(turns_per_s: tuple[float, ...]) -> np.ndarray:
    once = np.concatenate([np.repeat([v, -v], round(4000 / v)) for v in turns_per_s] + [np.zeros(500)])
    ramp = np.hanning(200)
    return 2 * np.pi * np.convolve(once, ramp / ramp.sum(), mode="same")


def _report(
    seed: int, turns_per_s: tuple[float, ...], tone_hz: float = 0.0, more: float = 0.0, **options: object
) -> OrderReport:
    """A rigid axis that follows its speed exactly, with order 6 of the motor, order 1 of a pinion, and a tone.

    `more` is added to the amplitude of order 6.
    """
    speed = _speed(turns_per_s)
    angle = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2)]) / RATE_HZ
    time_s = np.arange(speed.size) / RATE_HZ
    noise = np.random.default_rng(seed).normal(scale=0.02, size=speed.size)
    other = np.sin(2 * np.pi * tone_hz * time_s) * 0.1 if tone_hz else 0.0
    # The input of a sample acts until the next one.
    late = np.concatenate([np.diff(angle) / 2, [0.0]])
    rigid = INERTIA * np.gradient(speed) * RATE_HZ + 0.2 * np.sign(speed) + 0.01 * speed
    acting = (
        rigid - (RIPPLE + more) * np.cos(6 * (angle + late) + 0.5) - RIPPLE / 2 * np.sin(1.5 * (angle + late)) - other
    )
    block = Block([acting + noise, angle], (Channel("u", "N m"), Channel("x", "rad")), RATE_HZ)
    samples = MotionSamples(block, "u", "x", "position", len(block), None, {})
    return orders_of(samples, SHAFTS, **options)  # type: ignore[arg-type]


@cache
def _usual(seed: int) -> OrderReport:
    """Three speeds, without a tone."""
    return _report(seed, (1.0, 1.4, 2.0))


def test_orders_of_two_shafts_are_within_their_bounds() -> None:
    true = {"motor": [0, RIPPLE * np.exp(0.5j), 0], "pinion": [-0.5j * RIPPLE, 0]}
    errors, bounds = [], []
    for seed in range(20):
        for one in _usual(seed).shafts:
            errors.append(np.abs(one.value - true[one.shaft.name]))
            bounds.append([one.bound(1), one.bound(2)])
            assert one.seen.tolist() == [abs(value) > 0 for value in true[one.shaft.name]]
    error = np.concatenate(errors)
    for c, low in ((0, 0.53), (1, 0.94)):
        share = np.mean(error <= np.concatenate([both[c] for both in bounds]))
        print(f"{100 * share:.1f} % within bound({c + 1})")
        assert share >= low


def test_a_line_of_the_time_is_not_an_order_at_any_speed() -> None:
    tone_hz = 7.0  # order 7 at one turn a second
    slow = _report(0, (1.0, 1.0, 1.0), tone_hz, lines_hz=np.array([tone_hz]), highest_hz=9.0).shafts[0]
    assert slow.meets_hz[2] == tone_hz
    assert not slow.seen[2]
    both = _report(0, (1.0, 1.4, 2.0), tone_hz, lines_hz=np.array([tone_hz])).shafts[0]
    assert np.isnan(both.meets_hz[2])
    assert both.seen.tolist() == [False, True, False]
    assert not _report(0, (1.0, 1.4, 2.0), tone_hz).shafts[0].seen[2]


@pytest.mark.parametrize("tone_hz", [23.3, 50.0])
def test_a_line_that_nobody_specified_is_found_as_a_line_of_the_time(tone_hz: float) -> None:
    found = _report(0, (1.0, 1.4, 2.0), tone_hz)
    assert [line.frequency_hz for line in found.found_lines] == [pytest.approx(tone_hz, abs=0.1)]
    assert found.found_lines[0].amplitude == pytest.approx(0.1, rel=0.05)
    assert found.shafts[0].seen.tolist() == [False, True, False]


def test_strokes_without_a_line_have_none_and_one_speed_cannot_tell() -> None:
    """0.1 % a recording: one of 300 has a probability of 26 %, two of 4 %."""
    rng = np.random.default_rng(8)
    assert sum(bool(time_lines(_strokes_of_noise(rng, (1.0, 1.4, 2.0)), 300.0)) for _ in range(300)) <= 1
    hum = [
        replace(one, torque=one.torque + np.sin(2 * np.pi * 0.05 * np.arange(one.angle.size)))
        for one in _strokes_of_noise(rng, (1.0, 1.0, 1.0))
    ]
    assert time_lines(hum, 300.0) == []


def test_two_orders_at_one_frequency_at_two_speeds_are_no_line_of_the_time() -> None:
    """What an estimate leaves of order 24 at 2 turns/s is at the frequency of order 12 at 4 turns/s: 48 Hz."""
    rng = np.random.default_rng(9)
    strokes = [
        replace(one, torque=one.torque + np.cos(12 * one.angle) + np.cos(24 * one.angle + 1))
        for one in _strokes_of_noise(rng, (2.0, 4.0)) * 3
    ]
    assert [round(line.frequency_hz) for line in time_lines(strokes, 300.0)] == [48]
    assert time_lines(strokes, 300.0, (12.0, 24.0)) == []
    hum = [replace(one, torque=one.torque + np.sin(2 * np.pi * 0.06 * np.arange(one.angle.size))) for one in strokes]
    assert [round(line.frequency_hz) for line in time_lines(hum, 300.0, (12.0, 24.0))] == [60]


def _strokes_of_noise(rng: np.random.Generator, turns_per_s: tuple[float, ...]) -> list[Stroke]:
    """Strokes of four turns there and back, with correlated noise."""
    memory = np.exp(-np.arange(20) / 3)
    strokes = []
    for speed, way in itertools.product(turns_per_s, (1, -1)):
        angle = way * 2 * np.pi * speed * np.arange(round(4000 / speed)) / RATE_HZ
        noise = np.convolve(rng.normal(size=angle.size + 19), memory, "valid")
        strokes.append(Stroke(angle, noise[np.newaxis], 0, RATE_HZ))
    return strokes


def _shaft_of_noise(rng: np.random.Generator, value: Complex, dof: float) -> ShaftOrders:
    """Orders whose errors and sigmas are drawn as those of a mean over strokes."""
    many, true = value.size, 0.01
    error = true * np.sqrt(0.5) * (rng.normal(size=many) + 1j * rng.normal(size=many))
    sigma = true * np.sqrt(rng.gamma(dof, 1 / dof, many))
    shaft = Shaft("motor", 1.0, tuple(range(1, many + 1)))
    counts = np.full(many, 6)
    return ShaftOrders(
        shaft, value + error, sigma, np.full(many, dof), np.zeros(many, bool), counts, counts, counts * np.nan, True,
        np.zeros(many),
    )  # fmt: skip


@pytest.mark.parametrize("phases", [True, False])
def test_changed_orders_have_the_stated_rate_of_false_alarms_over_all_orders(phases: bool) -> None:
    """At 5 % over 48 orders, of 1000 healthy pairs more than 7 % have a probability of 0.3 %."""
    rng = np.random.default_rng(4)
    value = 0.05 * np.exp(1j * np.arange(48))
    alarms = 0
    for _ in range(1000):
        before, after = (_shaft_of_noise(rng, value, 5.0) for _ in range(2))
        alarms += any(c.changed for c in order_changes([before], [after], phases=phases, false_alarm=0.05))
    print(f"{alarms / 10:.1f} % false alarms")
    assert alarms <= 0.07 * 1000


def test_an_order_that_grew_is_named_and_the_others_are_not() -> None:
    before = _usual(0)
    for seed in range(1, 6):
        changed = [c for c in _report(seed, (1.0, 1.4, 2.0), more=0.02).changes_from(before) if c.changed]
        assert [(c.shaft, c.order) for c in changed] == [("motor", 6)]
        assert abs(abs(changed[0].after) - abs(changed[0].before) - 0.02) <= changed[0].difference_bound
        assert "order 6 of the motor changed: 0.0" in changed[0].sentence("N m")
        assert not any(c.changed for c in _usual(seed + 10).changes_from(before))
    with pytest.raises(UsageError, match="no known order in common"):
        order_changes(before.shafts[:1], before.shafts[1:])


def test_ripple_of_the_simulated_axis_is_found_at_three_speeds() -> None:
    case = CASES["three speeds"]
    found = measured(case, seed=3).shafts[0]
    assert np.all(np.abs(found.value - truth(case)) <= found.bound(2.5))
    assert [order for order, seen in zip(SHAFT.orders, found.seen) if seen] == [24]


def test_the_error_by_a_delay_between_torque_and_motion_is_the_stated_one() -> None:
    """The torque is recorded 0.5 ms late: order 24 is 3 % too small, outside of its bound of a simultaneous record."""
    late_samples = 2
    right, late = (
        measured(replace(CASES["three speeds"], late_samples=samples), seed=4).shafts[0]
        for samples in (0, late_samples)
    )
    at = SHAFT.orders.index(24)
    error = np.abs(late.value - right.value)[at]
    assert error > 0.02 * np.abs(right.value[at])
    assert error == pytest.approx(late.per_delay_s[at] * late_samples / 4000, rel=0.15)


def test_a_ripple_is_found_while_an_excitation_runs_whose_lines_it_meets() -> None:
    """Order 24 is at 20.1 and 40.2 Hz in four of six strokes, and lines are at 20 and 40 Hz."""
    case = CASES["three speeds, excited"]
    report = measured(case, seed=3)
    found = report.shafts[0]
    assert {20.0, 40.0} <= set(report.subtracted_hz)
    assert np.all(np.abs(found.value - truth(case)) <= found.bound(2.5))
    assert [order for order, seen in zip(SHAFT.orders, found.seen) if seen] == [24]


def test_a_ripple_that_moves_a_slow_axis_does_not_make_its_inertia_too_small() -> None:
    """Without the ripple's subtraction, the inertia is 4 % too small here, and the ripple with it."""
    case = CASES["the same, three times the ripple"]
    report = measured(case, seed=0)
    curve, found = report.friction, report.shafts[0]
    at = curve.index("inertia")
    assert abs(curve.value[at] - friction_truth(SLIDING)["inertia"]) <= curve.bound(0.99)[at]
    assert curve.bound()[at] < 0.03 * curve.value[at]
    assert np.all(np.abs(found.value - truth(case)) <= found.bound(2.5))


def test_an_eccentric_encoder_is_told_from_a_torque_ripple() -> None:
    """The simulated encoder reads φ + e·sin φ: the error of order 1 is seen, and the ripple is no error."""
    found = measured(ECCENTRIC, seed=1).errors[0]
    assert [order for order, seen in zip(SHAFT.orders, found.seen) if seen] == [1]
    assert abs(found.value[0] + 1j * ECCENTRIC.eccentricity_rad) <= found.bound(2.5)[0]


def test_position_errors_of_a_torque_ripple_are_not_seen_and_within_their_bounds() -> None:
    errors, bounds, seen = [], [], []
    for seed in range(20):
        for one in _usual(seed).errors:
            errors.append(np.abs(one.value))
            bounds.append([one.bound(1), one.bound(2)])
            seen.append(one.seen)
    error = np.concatenate(errors)
    for c, low in ((0, 0.5), (1, 0.92)):
        share = np.mean(error <= np.concatenate([both[c] for both in bounds]))
        print(f"{100 * share:.1f} % within bound({c + 1})")
        assert share >= low
    assert not np.concatenate(seen).any()
    assert np.isnan(_report(0, (1.0, 1.0, 1.0)).errors[0].value).all()


def test_strokes_shorter_than_a_window_and_wrong_shafts_are_refused() -> None:
    with pytest.raises(UsageError, match="not different whole numbers"):
        Shaft("motor", 1.0, (1, 1))
    with pytest.raises(UsageError, match="turn=-1 is not a positive number"):
        _report(0, (1.0,), turn=-1)
    with pytest.raises(SignalError, match="less than the 2 turns of a window"):
        _report(0, (1.0,), turn=100.0)


@pytest.fixture(scope="module")
def example(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("strokes")
    write_examples(["strokes"], folder)
    return folder


def _table(example: Path, name: str) -> str:
    done = livebode("orders", example / "strokes.toml", "--table", example / name, "--json")
    assert done.code == 0, done.err
    assert [o["order"] for o in json.loads(done.out)["shafts"][0]["orders"] if o["seen"]] == [24]
    return (example / name).read_text(encoding="utf-8")


def test_feedforward_tables_cancel_the_ripple_and_agree(example: Path) -> None:
    rows = [row.split(",") for row in _table(example, "ff.csv").splitlines() if row[0].isdigit()]
    angle, torque = np.array(rows, dtype=np.float64).T
    assert np.max(np.abs(torque + 0.05 * np.sin(24 * angle))) < 0.003
    _table(example, "ff.h")
    program = '#include <stdio.h>\n#include "ff.h"\nint main(void){for(int i=0;i<RIPPLE_FEEDFORWARD_POINTS;++i)'
    (example / "main.c").write_text(program + 'printf("%.17g\\n",ripple_feedforward[i]);return 0;}\n')
    subprocess.run(["cc", "-o", example / "played", example / "main.c"], check=True, timeout=60)
    played = subprocess.run([example / "played"], capture_output=True, text=True, check=True, timeout=60)
    assert [float(line) for line in played.stdout.split()] == torque.tolist()


def test_the_function_block_of_a_feedforward_interpolates_over_the_turn(tmp_path: Path) -> None:
    torque = np.random.default_rng(1).normal(size=11) * np.logspace(-9, 1, 11)
    write_angle_table(tmp_path / "ff.st", torque, ["order 1"], "N m")
    block = Machine((tmp_path / "ff.st").read_text("utf-8")).instance("FB_RippleFeedforward")
    block()
    for at in (*np.random.default_rng(2).uniform(0, 2 * np.pi, 20), 0.0, -0.1, 6.3):
        block["angle"] = float(at)
        block()
        expected = np.interp(at / (2 * np.pi) * 11, np.arange(12), np.append(torque, torque[0]), left=0, right=0)
        assert block["torque"] == pytest.approx(expected, abs=1e-12)


def test_wrong_options_of_orders_end_in_a_sentence(example: Path) -> None:
    for arguments, sentence in (
        (("--shaft", "gear"), "the shaft 'gear' cannot be read"),
        (("--shaft", "=1:1"), "a shaft has no name"),
        (("--time-lines", "a"), "the lines 'a' cannot be read"),
        (("--time-lines", "20,0"), "the line 0 Hz is not a positive frequency"),
        (("--time-lines", "nan"), "the line nan Hz is not a positive frequency"),
        (("--highest", "nan"), "highest_hz=nan is not a positive number"),
        (("--highest", "0"), "highest_hz=0.0 is not a positive number"),
        (("--band", "0"), "band_hz=0.0 is out of its range"),
        (("--table", example / "ff.txt"), "does not end in a supported suffix"),
        (("--shaft", "pinion=1.5:1", "--table", example / "other.csv"), "no order of the motor is seen"),
    ):
        done = livebode("orders", example / "strokes.toml", *arguments)
        assert done.code == 2
        assert sentence in done.err
        assert "Traceback" not in done.err


@pytest.mark.parametrize(
    ("command", "option", "name"),
    [("orders", "--table", "own.csv"), ("orders", "--picture", "own.png"), ("friction", "--picture", "own.png")],
)
def test_a_file_is_replaced_only_with_force(example: Path, command: str, option: str, name: str) -> None:
    file = example / name
    file.write_text("mine")
    refused = livebode(command, example / "strokes.toml", option, file)
    assert refused.code == 2
    assert "exists already" in refused.err
    assert file.read_text() == "mine"
    assert livebode(command, example / "strokes.toml", option, file, "--force").code == 0
    assert file.read_bytes() != b"mine"


def test_orders_above_the_highest_frequency_are_not_known(example: Path) -> None:
    """Order 24 is at 24 times the speed of the strokes, 0.8 … 1.7 turns/s."""
    for options, known in (((), 24), (("--highest", 10), 6)):
        found = json.loads(livebode("orders", example / "strokes.toml", *options, "--json").out)
        motor = found["shafts"][0]["orders"]
        assert max(one["order"] for one in motor if one["windows"]) >= known
        assert [one["order"] for one in motor if one["seen"]] == [24] * (not options)


def test_channels_and_rate_from_options_give_the_orders_of_the_configuration(example: Path) -> None:
    options = ("--input", "u", "--velocity", "velocity", "--angle", "position", "--shaft", "motor=1:1,2,6,12,24,48")
    found = livebode("orders", example / "strokes.parquet", *options, "--rate", 4000, "--time", "none", "--json")
    described = json.loads(livebode("orders", example / "strokes.toml", "--json").out)
    assert json.loads(found.out)["shafts"][0] == described["shafts"][0]


def test_the_command_compares_with_a_baseline(example: Path) -> None:
    done = livebode("orders", example / "strokes.toml", "--baseline", example / "strokes.toml")
    assert done.code == 0, done.err
    assert "compared with strokes.toml: no order changed of 8; probability of a false alarm 0.1 %" in done.out
    found = livebode("orders", example / "strokes.toml", "--baseline", example / "strokes.toml", "--json")
    assert {one["changed"] for one in json.loads(found.out)["changes"]} == {False}
    columns = pq.read_table(example / "strokes.parquet").to_pydict()
    columns["position [rad]"] = [angle + 0.05 for angle in columns["position [rad]"]]
    pq.write_table(pa.table(columns), example / "homed.parquet")
    homed = (example / "strokes.toml").read_text("utf-8").replace("strokes.parquet", "homed.parquet")
    (example / "homed.toml").write_text(homed, encoding="utf-8")
    for options, changed in (((), {False, True}), (("--other-zero",), {False})):
        compared = ("orders", example / "homed.toml", "--baseline", example / "strokes.toml", *options, "--json")
        assert {one["changed"] for one in json.loads(livebode(*compared).out)["changes"]} == changed
    missing = livebode("orders", example / "strokes.toml", "--baseline", example / "none.toml")
    assert missing.code == 2
    assert "none.toml" in missing.err
