"""`livebode compare` against machines whose change is known, and against none."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from livebode.core import PER_LINE, Block, Lines, Responses
from livebode.estimation import Settings, Tracker
from livebode.fitting import mean_response
from livebode.interface import write_examples
from livebode.records import RunRecord
from livebode_reports.difference import ALPHA, Difference, compare
from tests.support import command
from tests.support.browser import chromium
from tests.support.command import livebode
from tests.support.reports import LINES, measured, plant, strokes, write_run
from tests.support.servo_csv import write_servo

_SETTINGS = Settings(lines=command.LINES, output="y", input="u", excitation="w", hop=20)


def tracked(seed: int, samples: int = 1500) -> Responses:
    columns = command.signals(samples, noise=0.1, seed=seed)
    block = Block(np.array([columns[name] for name in "wuy"]), ("w", "u", "y"), command.RATE_HZ)
    return Tracker(_SETTINGS).process(block)


def test_two_runs_of_one_machine_differ_no_more_often_than_the_stated_rate() -> None:
    """200 pairs of tracked recordings: 5 % of them and three deviations of their count are the most."""
    pairs = 200
    means = [mean_response(tracked(seed))[0] for seed in range(2 * pairs)]
    found = [Difference.of(means[2 * i], means[2 * i + 1]) for i in range(pairs)]
    claimed = sum(d.differs.any() for d in found)
    print(f"{claimed} of {pairs} pairs of runs of the same machine are told apart at any line")
    assert claimed <= pairs * ALPHA + 3 * np.sqrt(pairs * ALPHA * (1 - ALPHA))
    # It is on the safe side (overlapping windows hold a little more than they count for), and not by much.
    p = np.array([d.p for d in found])
    assert 0.03 < np.mean(p < 0.1) < 0.1 + 3 * np.sqrt(0.1 * 0.9 / p.size)
    for d in found:
        np.testing.assert_array_equal(d.differs, np.abs(d.ratio - 1) > d.bound)


def test_a_change_is_found_at_its_lines_and_by_its_amount() -> None:
    f = LINES.frequency_hz
    before, after = (mean_response(measured(400, seed, resonance_hz=hz))[0] for seed, hz in ((1, 62.0), (2, 61.0)))
    found, true = Difference.of(before, after), (plant(f, 61.0) / plant(f, 62.0))[0]
    assert found.differs[f == 60].all()
    assert np.all(np.abs(found.ratio - true) < found.bound)
    large = np.abs(true - 1) > 2 * found.bound
    assert large.sum() >= 3
    assert found.differs[large].all()


def moving(path: Path, seed: int, softer: float = 1.0, rows: int = 900, **way: float) -> Path:
    """A run whose resonance goes with the place, and is `softer` beyond 1 m."""
    x = strokes(rows, **way)
    hz = (50 + 15 * x) * np.where(x > 1.0, softer, 1.0)
    return write_run(path, measured(rows, seed, resonance_hz=hz, schedule=x))


def test_runs_in_motion_are_compared_at_the_same_places(tmp_path: Path) -> None:
    claims = 0
    for i in range(20):
        one, other = moving(tmp_path / f"a{i}", 2 * i), moving(tmp_path / f"b{i}", 2 * i + 1, rows=960)
        same = compare(RunRecord.open(one), RunRecord.open(other))
        assert len(same.places) == 24
        claims += bool(same.overall.differs.any()) + any(p.difference.differs.any() for p in same.places)
    assert claims <= 4  # of 40: chance has 5 or more once in 50 times, and places that vary make it rarer
    changed = compare(RunRecord.open(one), RunRecord.open(moving(tmp_path / "c", 99, softer=0.95)))
    low = [p for p in changed.places if p.high <= 1.0]
    high = [p for p in changed.places if p.low >= 1.1]
    assert not any(p.difference.differs.any() for p in low)
    assert all(p.difference.differs.any() for p in high)


def test_runs_of_another_direction_or_speed_are_reported(tmp_path: Path) -> None:
    usual = RunRecord.open(moving(tmp_path / "a", 1))
    shorter = compare(usual, RunRecord.open(moving(tmp_path / "b", 2, high=0.9)))
    assert any("only the common part is compared" in w for w in shorter.warnings)
    assert max(p.high for p in shorter.places) <= 0.9 + 1e-9
    faster = compare(usual, RunRecord.open(moving(tmp_path / "c", 3, per_stroke=40)))
    assert any("different speeds" in w for w in faster.warnings)
    elsewhere = compare(usual, RunRecord.open(moving(tmp_path / "d", 4, low=2.0, high=3.0)))
    assert any("no place in common" in w for w in elsewhere.warnings)
    assert not elsewhere.places
    at_standstill = compare(usual, RunRecord.open(write_run(tmp_path / "e", measured(300, 5))))
    assert any("Only one of the runs has a changing schedule" in w for w in at_standstill.warnings)


@pytest.mark.parametrize("fit", [{"model": "two-mass", "output": "velocity", "radius_m": 0.019}, None])
def test_a_lost_stiffness_is_the_change_of_the_fitted_parameter(tmp_path: Path, fit: dict[str, object] | None) -> None:
    """The belt axis as `run` writes it, also without a [fit]: 5 % less stiffness is 5 % of Keff."""
    from livebode.fitting import EvaluationGrid, TwoMass

    model = TwoMass(radius_m=0.019)
    configuration = {"signals": {"output": "y"}} | ({} if fit is None else {"fit": fit})
    paths = []
    for seed, stiffness in ((1, 5e5), (2, 4.75e5)):
        true = model.at(np.array([0.0028, 6.7, stiffness, 130.0, 0, 0, 0]), EvaluationGrid(LINES.frequency_hz, 4000.0))
        one = measured(400, seed, noise=0.01)
        scaled = one.value / plant(LINES.frequency_hz, 62.0) * true
        paths.append(write_run(tmp_path / str(seed), replace(one, value=scaled), configuration=configuration))
    done = livebode("compare", *paths, "--json")
    assert done.code == 0, done.err
    table = {row["name"]: row for row in json.loads(done.out)["parameters"]}
    assert table["Keff"]["significant"]
    loss = 0.05 * (5e5 if fit is not None else 5e5 * 0.019**2)  # without a radius in N m/rad
    assert abs(table["Keff"]["change"] + loss) < table["Keff"]["change_bound"]
    for name in ("Js", "mL" if fit is not None else "JL", "bs"):
        assert not table[name]["significant"], name
    printed = livebode("compare", *paths)
    assert printed.out.startswith("belt stiffness −")
    assert "Keff" not in printed.out
    assert "changed" in printed.out


def test_runs_of_another_unit_or_quantity_or_without_common_lines_are_refused(tmp_path: Path) -> None:
    usual = write_run(tmp_path / "a", measured(50, 1))
    other_unit = write_run(tmp_path / "b", replace(measured(50, 2), unit="rad/s/A"))
    quantity = write_run(tmp_path / "c", replace(measured(50, 2), quantity="sensitivity"))
    elsewhere = write_run(tmp_path / "d", replace(measured(50, 2), lines=Lines.parse("30:150:20", 4000, 400)))
    for other, words in (
        (other_unit, "'rad/s/A'"), (quantity, "'sensitivity'"), (elsewhere, "no line in common"),
        (tmp_path, "not the directory of a run"),
    ):  # fmt: skip
        done = livebode("compare", usual, other)
        assert (done.code, words in done.err) == (2, True), done.err
    some = replace(measured(50, 2)[:], lines=Lines.parse("20:140:20", 4000, 400))
    fewer = write_run(tmp_path / "e", _first_lines(some, 3))
    done = livebode("compare", usual, fewer, "--json")
    assert [line["frequency_hz"] for line in json.loads(done.out)["lines"]] == [20, 40, 60]
    assert "3 of 7 and 3 lines in common" in " ".join(json.loads(done.out)["warnings"])


@pytest.mark.parametrize(("size", "differing"), [("0.5dB", 0), ("5.5%", 0), ("0.1 dB", 7), ("2%", 7)])
def test_a_certain_change_smaller_than_matters_is_ignored(tmp_path: Path, size: str, differing: int) -> None:
    """All lines are 4 % higher (0.34 dB), at a hundred times their uncertainty."""
    one = write_run(tmp_path / "a", measured(400, 1, noise=1e-3))
    other = measured(400, 2, noise=1e-3)
    two = write_run(tmp_path / "b", replace(other, value=1.04 * other.value))
    done = livebode("compare", one, two, "--ignore-below", size, "--json")
    assert done.code == 0, done.err
    lines = json.loads(done.out)["lines"]
    assert [sum(line[key] for line in lines) for key in ("differs", "ignored")] == [differing, 7 - differing]
    words = " ".join(json.loads(done.out)["sentences"])
    assert ("7 lines of 7 differ by less than" in words) == (differing == 0)


@pytest.mark.parametrize("size", ["0.5", "much", "-1dB", "1 sigma"])
def test_a_size_without_a_unit_is_refused(tmp_path: Path, size: str) -> None:
    one = write_run(tmp_path / "a", measured(50, 1))
    done = livebode("compare", one, one, f"--ignore-below={size}")
    assert (done.code, "is not a number of dB or %" in done.err) == (2, True)


def _first_lines(of: Responses, n: int) -> Responses:
    rows = {name: getattr(of, name)[:, :n] for name in PER_LINE}
    return replace(of, lines=Lines(of.lines.bins[:n], of.lines.window, of.lines.rate_hz), **rows)


def test_no_table_of_precise_parameters_is_wider_than_its_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bounds of 1e-7 and a change of nothing: many digits in each column."""
    monkeypatch.chdir(tmp_path)
    write_servo(tmp_path / "servo.csv", noise=1e-5)
    assert livebode("inspect", "servo.csv", "--out", "servo.toml", "--yes").code == 0
    for run in ("before", "after"):
        assert livebode("run", "servo.toml", "--out", run).code == 0
    assert livebode("compare", "before", "after", "--out", "both").code == 0
    with chromium() as browser:
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        page.goto((tmp_path / "both.html").as_uri())
        rows = page.locator("table:not(.answers)").first.locator("tbody tr").all_inner_texts()
        wide = page.evaluate(
            "[...document.querySelectorAll('div.wide')]"
            ".map((e) => [e.scrollWidth - e.clientWidth, e.innerText.slice(0, 99)])"
        )
        page.close()
    assert any("motor inertia" in row and "e-0" in row for row in rows), rows
    assert not [text for more, text in wide if more > 0]
    assert not any("-0.0" in row or "−0.0" in row or "0.00000000" in row for row in rows), rows


def test_of_equal_runs_each_amount_is_zero_and_no_number_below_a_million_has_an_exponent(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write_examples(["standstill"], tmp_path)
    assert livebode("run", "standstill.toml").code == 0
    shutil.copytree("runs/standstill", "runs/again")
    shown = livebode("compare", "runs/standstill", "runs/again").out
    rows = [row for row in shown.splitlines() if " → " in row]
    assert len(rows) >= 8
    for row in rows:
        assert " 0 ± " in row
    assert "e+0" not in shown
