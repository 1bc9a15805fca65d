"""Page 1 has the answer: of a servo that livebode did not make, before and after its belt lost a twelfth."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from pypdf import PdfReader

from livebode.fitting import EvaluationGrid, Fitter, TwoMass
from livebode_reports.answers import answers
from livebode_reports.parameter_track import Newest, Track
from livebode_reports.report_data import read
from livebode_reports.run_report import run_report
from tests.support.command import livebode
from tests.support.reports import LINES, measured, plant, strokes, write_run
from tests.support.servo import Servo, write_axis

BEFORE = Servo()
AFTER = Servo(stiffness=BEFORE.stiffness * 11 / 12)
MADE = datetime(2026, 11, 21, 12, tzinfo=UTC)
MOVING_FIT = {"model": "two-mass", "output": "velocity", "radius_m": 0.019}
LIMITS = """
[[report.limits]]
quantity = "resonance_hz"
min = 70
[[report.limits]]
quantity = "stiffness"
min = 200
"""


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("servo")
    for name, servo, seed, more in (("before", BEFORE, 1, ""), ("after", AFTER, 2, LIMITS)):
        done = livebode("run", write_axis(folder, name, servo, seed, 20, more), "--out", folder / f"run-{name}")
        assert done.code == 0, done.err
    return folder / "run-before", folder / "run-after"


def first_page(path: Path) -> str:
    """The text of page 1, as pdftotext reads it."""
    return " ".join(PdfReader(path.with_suffix(".pdf")).pages[0].extract_text().split())


def bounded(text: str, words: str) -> tuple[float, float]:
    found = re.search(rf"{words} ([−\d.]+) ± ([\d.]+(?:e-\d+)?)", text)
    assert found is not None, (words, text)
    return float(found[1].replace("−", "-")), float(found[2])


def test_a_perfect_measurement_is_headed_by_its_results(runs: tuple[Path, Path], tmp_path: Path) -> None:
    assert livebode("report", runs[0], "--out", tmp_path / "r").code == 0
    text = first_page(tmp_path / "r")
    for words, true in (
        ("resonance", BEFORE.resonance_hz), ("resonance damping ratio", 100 * BEFORE.damping_ratio),
        ("belt stiffness", BEFORE.stiffness), ("antiresonance", BEFORE.antiresonance_hz),
    ):  # fmt: skip
        value, bound = bounded(text, words)
        assert abs(value - true) < 1.5 * bound  # four at once: three sigma each
        assert bound < 0.05 * true
    assert "covers 95 %" in text
    assert text.index("resonance") < text.index("not assessed")
    for words in ("check", "rejected", "invalid line", "5–95 %"):
        assert words not in text
    page = (tmp_path / "r.html").read_text("utf-8").split("</header>")[0]
    assert re.search(r"<tr><th scope=\"row\">resonance</th><td class=\"value\">[\d.]+ ± [\d.]+ Hz</td>", page)


def test_without_a_model_the_peak_of_the_lines_is_the_answer(tmp_path: Path) -> None:
    path = write_axis(tmp_path, "axis", BEFORE, 3)
    path.write_text(path.read_text("utf-8").split("[fit]")[0], encoding="utf-8")
    assert livebode("run", path, "--out", tmp_path / "run").code == 0
    document = run_report(tmp_path / "run", made=MADE)
    (answer,) = document.answers
    low, high = map(float, re.search(r"peak between (\S+) and (\S+) Hz", answer.name).groups())  # type: ignore[union-attr]
    assert low < BEFORE.resonance_hz < high == low + 8
    assert re.fullmatch(r"[\d.]+ ± [\d.]+ dB at 76 Hz", answer.value)


def test_of_an_axis_that_moved_the_range_over_the_travel_is_the_answer(tmp_path: Path) -> None:
    """A belt whose stiffness goes with the place, between both ends of what 90 % of the responses have."""
    x = strokes(400)
    stiffness = 5e5 * (1 + 0.2 * (x - 0.5))
    model, grid = TwoMass(radius_m=0.019), EvaluationGrid(LINES.frequency_hz, 4000.0)
    true = np.array([model.at(np.array([0.0028, 6.7, k, 130.0, 0, 0, 0]), grid) for k in stiffness])
    one = measured(400, 1, noise=0.002, schedule=x)
    responses = replace(one, value=one.value / plant(LINES.frequency_hz, 62.0) * true)
    path = write_run(tmp_path / "run", responses, configuration={"signals": {"output": "y"}, "fit": MOVING_FIT})
    run = read(path)
    fitted = Fitter("two-mass", radius_m=0.019).process(responses)
    track = Track(run.of.overview.time_s, model="two-mass")
    for name, unit, value, sigma in zip(fitted.names, fitted.units, fitted.value.T, fitted.sigma.T):
        track.values[name], track.sigmas[name] = value, sigma
        track.newest[name] = Newest(value[-1], sigma[-1], unit, 1.0, "ok")
    found = {a.name: a.value for a in answers(replace(run, tracks={"two-mass": track}))}
    low, high, bound = re.fullmatch(r"(\d+) … (\d+) N/m \(± (\S+)\)", found["belt stiffness"]).groups()  # type: ignore[union-attr]
    ends = np.quantile(stiffness, (0.05, 0.95))
    assert np.all(np.abs(np.array([float(low), float(high)]) - ends) < 2 * float(bound)), (low, high, ends)


@pytest.mark.parametrize(
    ("language", "words"), [("de", "Riemensteifigkeit"), ("zh-CN", "皮带刚度")], ids=["de", "zh-CN"]
)  # fmt: skip
def test_the_answer_is_in_the_language_of_the_report(
    runs: tuple[Path, Path], tmp_path: Path, language: str, words: str
) -> None:
    done = livebode("report", runs[0], "--out", tmp_path / "r", "--language", language)
    assert done.code == 0, done.err
    assert words in (tmp_path / "r.html").read_text("utf-8").split("</header>")[0]


def test_what_was_asked_is_on_page_1_with_limit_and_result(runs: tuple[Path, Path], tmp_path: Path) -> None:
    assert livebode("report", runs[1], "--out", tmp_path / "r").code == 0
    text = first_page(tmp_path / "r")
    assert re.search(r"resonance [\d.]+ ± [\d.]+ Hz ≥ 70 PASS", text), text
    assert re.search(r"stiffness [\d.]+ ± [\d.]+ N m/rad ≥ 200 FAIL", text), text
    assert "resonance damping ratio" in text


def test_a_comparison_begins_with_the_parameter(runs: tuple[Path, Path], tmp_path: Path) -> None:
    done = livebode("compare", *runs, "--out", tmp_path / "c")
    first, second, *_ = done.out.splitlines()
    assert first.startswith("belt stiffness −")
    for text, words in ((first, "belt stiffness"), (first_page(tmp_path / "c"), "belt stiffness")):
        change, bound = bounded(text, words)
        assert abs(change + 100 / 12) < bound
    change, bound = bounded(first, "resonance")
    assert abs(change - 100 * (AFTER.resonance_hz / BEFORE.resonance_hz - 1)) < bound
    assert "together with 95 %" in first
    assert "lines of 49 differ, most certainly at" in second
    rows = [line for line in done.out.splitlines() if re.match(r" +\d+ Hz ", line)]
    plain = json.loads(livebode("compare", *runs, "--json").out)
    differing = sum(line["differs"] for line in plain["lines"])
    assert (len(rows), len(plain["lines"])) == (10, 49)
    assert f"and {differing - 10} more lines that differ; --json prints all lines" in done.out


def test_of_two_runs_that_do_not_differ_one_line_does_not_stand_for_all(runs: tuple[Path, Path]) -> None:
    done = livebode("compare", runs[0], runs[0])
    parameter, lines, *_ = done.out.splitlines()
    assert parameter.startswith("No significant change of a parameter (detectable: belt stiffness ≥ ")
    detectable = [100 * line["detectable"] for line in json.loads(livebode("compare", *runs, "--json").out)["lines"]]
    assert max(detectable) > 20 * min(detectable)  # at the antiresonance
    least, most = re.search(r"at half of the lines \(([\d.]+) % … ([\d.]+) %\)", lines).groups()  # type: ignore[union-attr]
    assert float(most) > 20 * float(least)
