"""Periods that differ from those around them are left out of averages, sigma and fits; other states are not."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from livebode.configuration import Axis
from livebode.records import RunRecord
from livebode.runtime import Destination, run
from tests.support.command import write_parquet
from tests.support.disturbed import NOISE, RATE_HZ, WINDOW, recorded


def ran(folder: Path, columns: dict[str, np.ndarray], **sections: dict[str, object]) -> RunRecord:
    log = write_parquet(folder / "log.parquet", columns)
    tracking = {"average": True, "forgetting": 1.0} | sections.pop("tracking", {})
    roles = {"input": "u", "output": "y"} | ({} if tracking.get("estimator") == "direct" else {"excitation": "w"})
    data = {"source": {"log": log, "rate_hz": RATE_HZ}, "signals": roles, "tracking": tracking}
    lines = {"frequencies": "20:140:20", "window": WINDOW}
    out = folder / f"run{len(list(folder.iterdir()))}"
    run(Axis.of(data | {"lines": lines} | sections, "the test"), Destination(out, lambda *_: None))
    return RunRecord.open(out)


def left_out(of: RunRecord) -> list[int]:
    events = [json.loads(line) for line in (of.path / "events.jsonl").read_text("utf-8").splitlines()]
    return [period for event in events if event["kind"] == "outlying-periods" for period in event["details"]["periods"]]


CASES = {
    "a spike early, in the middle and late": ({"spikes": (3, 9, 16)}, [3, 9, 16]),
    "a disturbance": ({"disturbed": (10, 11)}, [10, 11]),
    "the last period": ({"disturbed": (19,)}, [19]),
    "far apart in a long recording": ({"periods": 200, "spikes": (3, 70, 71, 199), "disturbed": range(120, 128)},
                                      [3, 70, 71, *range(120, 128), 199]),
    "a transient, and a spike behind it": ({"settles": 5.0, "spikes": (3,)}, [3]),
    "another state of the machine": ({"changes": 15}, []),
    "nothing": ({}, []),
}  # fmt: skip


@pytest.mark.parametrize("estimator", ["joint", "direct"])
@pytest.mark.parametrize("case", CASES)
def test_periods_that_differ_are_left_out_and_named(tmp_path: Path, case: str, estimator: str) -> None:
    what, periods = CASES[case]
    run = ran(tmp_path, recorded(**what), tracking={"estimator": estimator})
    assert left_out(run) == periods
    last = run.responses()[-1]
    transient = run.found["left_out_samples"] // WINDOW
    assert transient == ("settles" in what)
    assert last.dof == what.get("periods", 20) - transient - len(periods) - 1
    if "changes" not in what:
        # Of noise N per sample over M periods: |Ĝ − G| has σ = N·√2·√(1/(N M)) at lines of amplitude 1; 5σ at 7 lines.
        expected = NOISE * np.sqrt(4 / WINDOW / (last.dof + 1))
        assert np.all(np.abs(last.value - 2) < 5 * expected)
        assert 0.5 * expected < np.median(last.sigma) < 1.5 * expected


def test_a_pause_is_left_out_however_long(tmp_path: Path) -> None:
    run = ran(tmp_path, recorded(100, pauses=range(30, 55)))
    assert set(range(30, 55)) <= set(left_out(run)) <= set(range(29, 56))
    assert np.all(np.abs(run.responses()[-1].value - 2) < 5 * NOISE * np.sqrt(4 / WINDOW / 73))


def test_only_windows_with_such_a_period_are_invalid_and_all_periods_keeps_them(tmp_path: Path) -> None:
    columns, single = recorded(disturbed=(10,)), {"average": False}
    careful, plain = (
        ran(tmp_path, columns, tracking=single),
        ran(tmp_path, columns, tracking=single | {"all_periods": True}),
    )
    assert (left_out(careful), left_out(plain)) == ([10], [])
    some, every = careful.responses(), plain.responses()
    overlaps = (some.sample >= 10 * WINDOW) & (some.first < 11 * WINDOW)
    whole = every.valid.all(axis=1)
    assert np.array_equal(some.valid.all(axis=1), whole & ~overlaps)
    assert np.array_equal(some.value[whole & ~overlaps], every.value[whole & ~overlaps])


def test_no_fit_is_of_a_period_that_is_left_out(tmp_path: Path) -> None:
    columns = recorded()
    columns["y"] = np.cumsum(columns["u"]) / RATE_HZ * 100  # 1/(J s) with J = 0.01 kg m²
    at = np.arange(WINDOW)
    columns["y"][10 * WINDOW : 11 * WINDOW] += 0.5 * np.sin(2 * np.pi * 33 * at / RATE_HZ)
    fit = {"model": "rigid", "output": "velocity"}
    run = ran(tmp_path, columns, fit=fit, tracking={"average": False, "differenced": ["y"]})
    assert left_out(run) == [10]
    table = pq.read_table(run.path / "parameters.parquet").to_pydict()
    fitted = np.array(table["status"]) == "ok"
    sample = np.array(table["sample"])
    assert not np.any(fitted & (sample >= 10 * WINDOW) & (sample < 12 * WINDOW - 1))
    assert np.all(fitted[(sample >= 12 * WINDOW - 1) | ((sample >= 2 * WINDOW) & (sample < 10 * WINDOW))])
