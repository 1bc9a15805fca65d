"""`livebode archive trend` and `archive compare` on the lake of a simulated hall, whose faults are known."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from tests.support.command import livebode
from tests.support.drawn_svg import SVG, checked


@pytest.fixture(scope="module")
def hall(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("example")
    assert livebode("example", "hall", "--out", folder).code == 0
    return folder / "hall"


def test_the_machines_with_a_fault_are_marked_and_ranked_with_the_true_amounts(hall: Path) -> None:
    found = json.loads(livebode("archive", "trend", hall, "Keff", "--by", "axis", "--json").out)
    changed = {one["machine"]: one for one in found["machines"] if one["significant"]}
    assert list(changed) == ["A/L1/M3/x", "A/L1/M4/x", "A/L1/M2/x"]
    for machine, truth in (("A/L1/M3/x", -0.8), ("A/L1/M4/x", -0.1)):
        one = changed[machine]
        percent = one["percent_of_unit"]
        assert abs(percent * one["per_month"] - truth) <= percent * one["per_month_bound_95"]
    (jump,) = changed["A/L1/M2/x"]["changes"]
    level = changed["A/L1/M2/x"]["level"]
    assert jump["kind"] == "jump"
    assert "2025-06-13" <= jump["date"] <= "2025-06-18"
    assert abs(jump["amount"] / level + 0.06) <= jump["bound_95"] / level
    assert [one["machine"] for one in found["not_assessed"]] == ["A/L2/M3/x"]
    assert [one["machine"] for one in found["silent"]] == ["A/L2/M1/x", "A/L2/M3/x"]
    (effect,) = changed["A/L1/M4/x"]["covariates"]
    assert abs(effect["per_unit"] / level + 0.001) <= effect["bound_95"] / level


def test_the_table_names_what_was_found_and_what_was_not_assessed(hall: Path) -> None:
    shown = livebode("archive", "trend", hall, "keff").out
    lines = shown.splitlines()
    assert lines[0] == "belt stiffness (two-mass model): 7 machines, 1069 runs"
    assert lines[2].startswith("A/L1/M3 *")
    assert "−5.89 ± 0.17 % on 2025-06-16" in shown
    assert "A/L2/M2: 2 axes together; --by axis shows each" in lines
    assert "A/L2/M3: not assessed: 9 runs with a value, and a trend needs 20" in lines
    assert "A/L2/M1: no run since 2025-08-12" in lines


def test_runs_are_selected_by_date_and_recipe_and_judged_by_the_limit(hall: Path) -> None:
    def trend(*options: object) -> Any:
        return json.loads(livebode("archive", "trend", hall, "Keff", *options, "--json").out)

    whole, half = trend("--recipe", "e1d8"), trend("--until", "2025-06-30")
    assert whole == trend()
    assert max(one["to"] for one in half["machines"]) <= "2025-06-30"
    assert half["runs"] < whole["runs"]
    refused = livebode("archive", "trend", hall, "Keff", "--recipe", "ffff")
    assert (refused.code, "Recipes: e1d8" in refused.err) == (2, True)
    near, far = (trend("--limit", percent)["machines"][0]["months_to_limit"] for percent in (10, 20))
    assert near < far
    assert livebode("archive", "compare", hall, "A/L1/M2/x", "--split", "2025-06-15", "--until", "2025-06-15").code == 2


def test_the_quarantine_and_the_rows_of_a_query_are_listed(hall: Path) -> None:
    bad = json.loads(livebode("archive", "list", hall, "--quarantined", "--json").out)["quarantine"]
    assert [(one["machine"], one["code"]) for one in bad] == [("M3", "recording.damaged")]
    shown = livebode("archive", "list", hall, "--sql", "SELECT axis FROM runs", "--rows", 3, "--csv")
    assert shown.out == "axis\nx\nx\nx\n"
    assert "only the first 3 rows" in shown.err


def test_a_picture_and_a_table_are_written_once(hall: Path, tmp_path: Path) -> None:
    picture, table = tmp_path / "year.svg", tmp_path / "trend.csv"
    for out in (picture, table):
        assert livebode("archive", "trend", hall, "Keff", "--machine", "A/L1", "--out", out).code == 0
        refused = livebode("archive", "trend", hall, "Keff", "--out", out)
        assert (refused.code, "exists already" in refused.err) == (2, True)
    assert livebode("archive", "trend", hall, "Keff", "--machine", "A/L1", "--out", table, "--force").code == 0
    texts = [text.text for text in checked(picture.read_text("utf-8")).iter(f"{SVG}text")]
    assert {"trend", "2025-01", "no runs"} & set(texts) >= {"trend"}
    assert texts[0] is not None
    assert "A/L1/M3" in texts[0]
    rows = list(csv.DictReader(table.read_text("utf-8").splitlines()))
    assert [row["machine"] for row in rows] == ["A/L1/M3", "A/L1/M4", "A/L1/M2", "A/L1/M1"]
    assert rows[2]["changes"] == "jump 2025-06-16"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["Kef"], "did you mean 'Keff'?"),
        (["Keff", "--since", "yesterday"], "write it as 2025-03-01"),
        (["Keff", "--out", "year.jpg"], "neither a .svg nor a .csv"),
        (["Keff", "--machine", "B", "--out", "year.svg"], "no machine has a trend to draw"),
        (["Keff", "--covariate", "temp"], "did you mean 'temperature'?"),
        (["--by", "axis"], "--by is for one quantity; name a QUANTITY, or omit it"),
        (["--out", "year.svg"], "--out='year.svg' is for one quantity; name a QUANTITY, or omit it"),
        (
            ["--out", "year.jpg"],
            "year.jpg is neither .html nor .pdf; choose one of them, or omit the ending (option --out)",
        ),
        (["Keff", "--name", "Hall 1"], "--name is for the page of all quantities; leave out the QUANTITY, or omit it"),
        (["Keff", "--language", "de"], "--language is for the page of all quantities"),
    ],
)
def test_a_wrong_word_is_one_sentence_with_what_to_do(hall: Path, words: list[str], said: str) -> None:
    refused = livebode("archive", "trend", hall, *words)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert said in refused.err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["list", "HALL", "--sql", "SELECT 1", "--quarantined"], "--quarantined and --sql exclude each other"),
        (["list", "HALL", "--rows", "3"], "--rows belongs to --sql"),
        (["run", "HALL", "--retry", "all", "--compact"], "--retry and --compact exclude each other"),
    ],
)
def test_an_option_of_the_other_use_is_refused(hall: Path, words: list[str], says: str) -> None:
    refused = livebode("archive", *(hall if word == "HALL" else word for word in words))
    assert (refused.code, says in refused.err) == (2, True), refused


@pytest.mark.parametrize(
    ("language", "words"),
    [
        (
            "en",
            ["3 of 7 axes changed significantly.", "belt stiffness of A/L1/M2/x fell by 5.89 ± 0.17 % on 2025-06-16."],
        ),
        ("de", ["3 von 7 Achsen haben sich signifikant geändert.", "sank am 2025-06-16 um 5,89 ± 0,17 %"]),
        ("zh-CN", ["7 个轴中有 3 个发生显著变化。"]),
    ],
)
def test_the_report_of_a_hall_says_what_changed_what_is_silent_and_what_is_not_assessed(
    hall: Path, tmp_path: Path, language: str, words: list[str]
) -> None:
    written = livebode("archive", "trend", hall, "--out", tmp_path / "hall", "--language", language, "--json")
    found = json.loads(written.out)
    assert (found["axes"], found["runs"], found["quarantined"]) == (8, 1069, 1)
    assert list(found["silent"]) == ["A/L2/M1/x", "A/L2/M3/x"]
    page = (tmp_path / "hall.html").read_text("utf-8")
    for text in (*words, "A/L2/M1/x", "the file ends in the middle of a row group; copy it again"):
        assert text in page
    assert page.count('class="figure"') == 1
    assert (tmp_path / "hall.pdf").read_bytes().startswith(b"%PDF")


def test_a_hall_without_enough_runs_has_a_report_that_says_so(hall: Path, tmp_path: Path) -> None:
    found = livebode("archive", "trend", hall, "--machine", "A/L2/M3", "--out", tmp_path / "few")
    assert found.code == 0
    page = (tmp_path / "few.html").read_text("utf-8")
    assert "No axis has enough runs for a trend." in page
    assert "<svg" not in page


def test_two_spans_of_an_axis_differ_by_its_fault_and_in_nothing_else(hall: Path) -> None:
    found = json.loads(livebode("archive", "compare", hall, "A/L1/M2/x", "--split", "2025-06-15", "--json").out)
    one = {each["name"]: each for each in found["differences"]}
    assert {name for name, each in one.items() if each["significant"]} == {"Keff", "gain_margin"}
    assert (
        abs(one["Keff"]["amount"] / one["Keff"]["first"] + 0.06)
        <= 1.05 * one["Keff"]["bound_95"] / one["Keff"]["first"]
    )


def test_two_healthy_axes_do_not_differ(hall: Path) -> None:
    shown = livebode("archive", "compare", hall, "A/L1/M1/x", "A/L2/M2/x").out
    assert "*" not in shown
    assert "160 / 160" in shown
    refused = livebode("archive", "compare", hall, "A/L1/M1/x", "A/L2/M2/z")
    assert (refused.code, "did you mean 'A/L2/M2/" in refused.err) == (2, True)
    assert livebode("archive", "compare", hall, "A/L1/M1/x").code == 2
    nothing = livebode("archive", "compare", hall, "A/L1/M1/x", "--split", "2024-01-01")
    assert (nothing.code, nothing.out) == (2, "")
    assert "the runs of A/L1/M1/x before and from 2024-01-01 on have no quantity in common" in nothing.err
