"""A matrix of a machine that was not ready in one of its windows is not valid, and raises no alarm."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from livebode.configuration import Axis
from livebode.core import ConfigError, Event, MatrixResponses
from livebode.records import RunRecord
from livebode.runtime import ENDED, SUPPRESSED, Destination, run
from livebode.simulation import GantryLoop
from tests.support.command import write_parquet
from tests.support.errors import refused
from tests.support.gantry_runs import DWELL, LINES, NAMES, RATE_HZ, SECTIONS, SETTLE, WINDOW, gantry_axis, gantry_block

CYCLE = 2 * DWELL * WINDOW
OFF = (2 * CYCLE + 1000, 2 * CYCLE + SETTLE * WINDOW + 300)
"""The drive is off until a window has begun: all windows of this experiment have its transient."""
STATUS_WORD = {"ready_mask": 0x6F, "ready_value": 0x27}
AVERAGE = SECTIONS["tracking"] | {"average": True}
ADJUSTED = (3 * CYCLE - 600, 6 * CYCLE - 300)
"""Somebody works at the machine for a whole matrix that is compared with the baseline."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings whose second speed is wrong until shortly after the drive was off, and the run `healthy`."""
    folder = tmp_path_factory.mktemp("ready")
    block = gantry_block(repetitions=36)  # a baseline of fewer shows large changes only
    columns = {"t [s]": np.arange(len(block)) / RATE_HZ} | {name: block[name].copy() for name in NAMES}
    gantry_run(folder, "healthy", columns)
    columns = {name: values[: 9 * CYCLE] for name, values in columns.items()}
    for name, (begin, end), factor in (("log", OFF, 3), ("adjusted", ADJUSTED, 1.1)):
        status = np.full(9 * CYCLE, 0x1637)
        status[begin:end] = 0x1633
        wrong = columns["velocity2"].copy()
        wrong[begin - 200 : end + 200] *= factor
        write_parquet(folder / f"{name}.parquet", columns | {"status": status, "velocity2": wrong})
    return folder


def gantry_run(folder: Path, name: str, columns: dict[str, Any]) -> None:
    log = write_parquet(folder / f"{name}.parquet", columns)
    run(gantry_axis(log, tracking=AVERAGE), Destination(folder / name, lambda *_: None))


def axis(folder: Path, *, ready: bool = True, **sections: Any) -> Axis:
    signals = SECTIONS["signals"] | ({"ready": "status"} if ready else {})
    monitoring = {"baseline": folder / "healthy"} | (STATUS_WORD if ready else {})
    given: dict[str, Any] = {"signals": signals, "monitoring": monitoring, "tracking": AVERAGE} | sections
    return gantry_axis(folder / "log.parquet", **given)


def tracked(of: Axis, directory: Path) -> tuple[MatrixResponses, list[Event], dict[str, Any]]:
    run(of, Destination(directory, lambda *_: None))
    found = RunRecord.open(directory, matrix=True)
    return found.matrix(), found.events(), found.summary


@pytest.mark.parametrize("average", [True, False])
def test_no_valid_matrix_has_a_window_that_is_not_ready_or_settles_after_it(
    folder: Path, tmp_path: Path, average: bool
) -> None:
    tracking = AVERAGE | {"average": average}
    found, events, summary = tracked(axis(folder, tracking=tracking, monitoring=STATUS_WORD), tmp_path / "run")
    valid = found.valid.all(axis=(1, 2))
    begin = OFF[1] // (DWELL * WINDOW) * DWELL * WINDOW  # of the experiment in which the drive was off
    left_out = (found.sample > begin) & (found.sample < begin + 2 * DWELL * WINDOW)
    assert not valid[left_out].any()
    assert (found.reason[left_out] == 1).all()  # incomplete
    assert valid[(found.sample > CYCLE) & (found.sample < begin)].all()
    after = np.flatnonzero(found.sample > begin + 2 * DWELL * WINDOW)
    assert valid[after].all()
    assert (found.first[after] >= begin + DWELL * WINDOW).all()
    truth = GantryLoop().gantry.response(LINES.frequency_hz, RATE_HZ)[:, :2]
    bound = found.bound(3.5)  # each with 1 − 5e-6
    known = np.flatnonzero(valid & (found.dof > 0))
    assert len(known) >= 10
    assert (np.abs(found.value - truth)[known] < bound[known]).all()
    begun, ended = (event for event in events if event.kind in (SUPPRESSED, ENDED))
    assert (begun.kind, begun.sample, begun.details["channel"]) == (SUPPRESSED, OFF[0], "status")
    assert (ended.kind, ended.sample) == (ENDED, OFF[1] + (SETTLE + 1) * WINDOW - 1)
    readiness = summary["readiness"]
    assert readiness["suppressed_s"] == pytest.approx((ended.sample - begun.sample) / RATE_HZ)
    assert readiness["responses"] == np.count_nonzero(
        (found.sample >= OFF[0]) & (found.sample - (SETTLE + 1) * WINDOW + 1 < OFF[1])
    )


def test_a_difference_while_the_machine_is_not_ready_is_an_alarm_only_without_the_channel(
    folder: Path, tmp_path: Path
) -> None:
    adjusted = {"source": {"log": folder / "adjusted.parquet"}}
    _, events, summary = tracked(axis(folder, **adjusted), tmp_path / "ready")
    assert not [event for event in events if event.kind.startswith("change")]
    assert "the machine was not ready" in summary["monitoring"]["message"]
    assert summary["monitoring"]["judged_s"] > CYCLE / RATE_HZ
    _, events, _ = tracked(axis(folder, ready=False, **adjusted), tmp_path / "unknown")
    assert [event.kind for event in events if event.kind.startswith("change")] == ["change", "change-cleared"]


def test_a_run_in_segments_that_was_stopped_while_not_ready_is_the_same(folder: Path, tmp_path: Path) -> None:
    expected, before, _ = tracked(axis(folder), tmp_path / "whole")
    configured = axis(folder, record={"segment_s": 1.0})

    class StopError(Exception):
        pass

    def stop(document: object) -> None:
        if isinstance(document, MatrixResponses) and len(document) and document.sample[-1] > OFF[1] + 2 * WINDOW:
            raise StopError

    with pytest.raises(StopError):
        run(configured, Destination(tmp_path / "run", lambda *_: None, subscribers=(stop,)))
    found, events, _ = tracked(configured, tmp_path / "run")
    assert found.equals(expected)
    kinds = [(event.kind, event.sample) for event in before]
    assert [(event.kind, event.sample) for event in events if not event.kind.startswith("record-")] == kinds


def test_bits_without_a_channel_are_refused(folder: Path, tmp_path: Path) -> None:
    with refused(ConfigError, "incomplete", key="signals.ready"):
        tracked(axis(folder, ready=False, monitoring=STATUS_WORD), tmp_path / "run")
