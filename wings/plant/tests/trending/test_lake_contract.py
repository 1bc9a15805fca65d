"""Histories from a lake: which runs belong to a trend, and which do not."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from livebode import ArchiveError
from livebode_plant.lake import TABLES, Lake
from livebode_plant.trending import Selection, assess, histories, history
from livebode_plant.trending.machine_year import START_S, MachineYear
from tests.support.halls import add, hall, rows

SHORT = MachineYear(runs=30)


@pytest.fixture(scope="module")
def lake(tmp_path_factory: pytest.TempPathFactory) -> Lake:
    return hall(
        tmp_path_factory.mktemp("hall") / "lake",
        {"A/L1/M1/x": MachineYear(per_month=-0.3), "A/L1/M1/y": SHORT, "A/L1/M2/x": SHORT, "A/L2/M3": SHORT, "": SHORT},
    )


def test_the_arrays_are_those_that_were_written(lake: Lake) -> None:
    found = history(lake, "Keff", Selection(by="axis"))
    time_s, value, bound, covariates = MachineYear(per_month=-0.3).measured(0)
    own = found.machines["A/L1/M1/x"]
    np.testing.assert_allclose(own.time_s, time_s, atol=1e-6)
    np.testing.assert_array_equal(own.value, value)
    np.testing.assert_array_equal(own.bound_95, bound)
    np.testing.assert_array_equal(own.covariates["temperature"], covariates["temperature"])
    assert (found.model, found.unit, found.runs, found.undated) == ("two-mass", "N/m", 320, 0)


@pytest.mark.parametrize(
    ("by", "names"),
    [
        ("site", ["A", "unnamed"]),
        ("line", ["A/L1", "A/L2", "unnamed"]),
        ("machine", ["A/L1/M1", "A/L1/M2", "A/L2/M3", "unnamed"]),
        ("axis", ["A/L1/M1/x", "A/L1/M1/y", "A/L1/M2/x", "A/L2/M3", "unnamed"]),
    ],
)
def test_levels_join_the_axes_below_them(lake: Lake, by: str, names: list[str]) -> None:
    found = history(lake, "Keff", Selection(by=by))  # type: ignore[arg-type]
    assert list(found.machines) == names
    assert found.runs == 320
    several = [name for name in names if len(found.machines[name].axes) > 1]
    assert all(found.unit_of(name) == ("%" if name in several else "N/m") for name in names)


def test_axes_of_a_machine_have_one_trend_in_percent_of_each(tmp_path: Path) -> None:
    lake = hall(tmp_path / "lake", {"M/x": MachineYear(per_month=-0.3)})
    add(lake, "M/y", MachineYear(per_month=-0.3), 1, unit="N/m")
    found = history(lake, "Keff", Selection(by="site"))
    (of,) = assess([found])
    (one,) = of.ranked
    assert one.significant
    assert found.machines["M"].axes == ("M/x", "M/y")
    assert abs(one.trend.per_month * one.trend.relative + 0.3) < one.trend.per_month_bound_95 + 0.01


def test_a_span_a_place_and_a_covariate_are_selected(lake: Lake) -> None:
    since, until = (datetime(2025, month, 1, tzinfo=UTC) for month in (4, 7))
    found = history(lake, "keff", Selection("axis", "A/L1/M1", since, until, covariates=["temperature"]))
    assert list(found.machines) == ["A/L1/M1/x", "A/L1/M1/y"]
    for machine in found.machines.values():
        assert since.timestamp() <= machine.time_s[0] <= machine.time_s[-1] < until.timestamp()
    assert found.runs == sum(
        int(((t := year.measured(seed)[0]) >= since.timestamp()).sum() - (t >= until.timestamp()).sum())
        for seed, year in enumerate((MachineYear(per_month=-0.3), SHORT))
    )
    assert list(history(lake, "Keff", Selection(below="A/L1/M")).machines) == []  # a name is not a prefix


@pytest.mark.parametrize(
    ("quantity", "of", "code", "words"),
    [
        ("Kef", Selection(), "archive.quantity-unknown", "did you mean 'Keff'"),
        ("Keff", Selection(covariates=["temprature"]), "archive.covariate-unknown", "did you mean 'temperature'"),
        ("Keff", Selection(recipe="b"), "archive.recipe-unknown", "aaaaaaaaaaaaaaaa"),
    ],
)
def test_a_wrong_name_is_an_error_with_the_nearest_one(
    lake: Lake, quantity: str, of: Selection, code: str, words: str
) -> None:
    with pytest.raises(ArchiveError, match=words) as caught:
        history(lake, quantity, of)
    assert caught.value.code == code


def test_a_name_of_two_models_needs_the_model(tmp_path: Path) -> None:
    lake = hall(tmp_path / "lake", {"M/a": SHORT})
    add(lake, "M/b", SHORT, 1, model="three-mass")
    with pytest.raises(ArchiveError, match=r"three-mass:Keff, two-mass:Keff") as caught:
        history(lake, "keff", Selection())
    assert caught.value.code == "archive.quantity-ambiguous"
    assert list(history(lake, "three-mass:Keff", Selection()).machines) == ["M/b"]
    assert [(one.model, one.runs) for one in histories(lake, Selection())] == [("three-mass", 30), ("two-mass", 30)]


def test_runs_without_a_date_or_with_other_settings_or_without_their_row_are_left_out(tmp_path: Path) -> None:
    lake = hall(tmp_path / "lake", {"M/a": SHORT})
    add(lake, "M/b", MachineYear(runs=3), 1, recorded_from=None)
    add(lake, "M/a", MachineYear(runs=4), 2, recipe="b" * 16)
    add(lake, "M/c", MachineYear(runs=4), 4, recipe="c" * 16)  # another axis has its own settings
    half = rows("M/d", SHORT, 3)  # a coordinator was killed before the rows of `runs`
    lake.add_rows("quantities", pa.Table.from_pylist(half, TABLES["quantities"].schema))
    found = history(lake, "Keff", Selection())
    assert (list(found.machines), found.undated, found.other_recipes) == (["M/a", "M/c"], 3, 4)
    assert len(found.machines["M/a"].time_s) == SHORT.runs
    assert history(lake, "Keff", Selection(recipe="bb")).other_recipes == 37


def test_a_machine_that_stopped_sending_is_reported(tmp_path: Path) -> None:
    lake = hall(tmp_path / "lake", {"M/a": MachineYear(), "M/b": MachineYear(months=10.0), "M/c": MachineYear(runs=5)})
    (of,) = assess(histories(lake, Selection()))
    assert {one.machine for one in of.ranked} == {"M/a", "M/b"}
    assert "M/b" in of.silent
    assert of.silent["M/b"] < START_S + 10.1 * 30.44 * 86400
    assert of.not_assessed == {"M/c": "5 runs with a value, and a trend needs 20"}


def test_an_empty_lake_has_no_quantity(tmp_path: Path) -> None:
    lake = Lake(str(tmp_path / "lake"))
    assert histories(lake, Selection()) == []
    with pytest.raises(ArchiveError, match="Quantities: none"):
        history(lake, "Keff", Selection())
