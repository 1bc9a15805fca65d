"""A run that ended and goes on keeps what its motion's correction, its fits and its monitoring had learnt."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
import pytest

from livebode import MotionCorrection, Tracker
from livebode.configuration import FitSection, RecordSection
from livebode.estimation import Follower
from livebode.monitoring import Baseline, Monitor
from livebode.records import RunRecord
from livebode.runtime import ChangeDetection, Document, Fits, Outcome, TrackerResults
from livebode.simulation import BeltAxis, Friction, Sensor, SimulatedAxis, Strokes, TensionLoss
from tests.support.axes import MULTISINE
from tests.support.monitored import machine
from tests.support.moving import SETTINGS
from tests.support.recorded import same
from tests.support.runs import record

AXIS = BeltAxis(
    motion=Strokes(speed_m_per_s=0.3), excitation_n_m=MULTISINE, seconds=4.5, friction=Friction(load_coulomb_n=15.0),
    sensor=Sensor(noise_rad_per_s=0.1), faults=(TensionLoss(start_s=1.5, loss=0.05),),
)  # fmt: skip
ROLES = {"output": "velocity", "input": "u", "excitation": "w", "schedule": "x"}


class StopError(Exception):
    pass


def detection() -> ChangeDetection:
    baseline = Baseline(SETTINGS.lines, SETTINGS.step, ROLES, "joint", "plant", (), machine())
    return ChangeDetection(Monitor(baseline, SETTINGS), "healthy.json")


def record_axis(follower: Follower, directory: Path, until: int | None = None) -> Outcome:
    def stop(document: Document) -> None:
        if isinstance(document, TrackerResults) and until is not None and document.samples > until:
            raise StopError

    return record(
        SimulatedAxis(AXIS), follower, directory, subscribers=[stop], fits=Fits(FitSection()), detection=detection(),
        segments=RecordSection(segment_s=1.5),
    )  # fmt: skip


@pytest.mark.parametrize(
    "follower",
    [lambda: Tracker(SETTINGS), lambda: MotionCorrection(SETTINGS, radius_m=0.019, chunk_samples=5200)],
    ids=["tracker", "correction"],
)
def test_correction_fits_and_monitoring_continue_in_a_resumed_run(
    tmp_path: Path, follower: Callable[[], Follower]
) -> None:
    whole = record_axis(follower(), tmp_path / "whole")
    for until in (6100, 14_300):
        with pytest.raises(StopError):
            record_axis(follower(), tmp_path / "run", until)
    outcome = record_axis(follower(), tmp_path / "run")
    runs = [RunRecord.open(tmp_path / name) for name in ("run", "whole")]
    assert same(runs[0].responses(), runs[1].responses())
    parameters = [pa.concat_tables(map(pa.table, run.tables("parameters"))).combine_chunks() for run in runs]
    assert parameters[0].num_rows > 1000
    # NaN is not equal to itself, and its text is.
    assert str(parameters[0].to_pydict()) == str(parameters[1].to_pydict())
    reported = [[event for event in run.events() if not event.kind.startswith("record-")] for run in runs]
    assert reported[0] == reported[1]
    assert "change" in [event.kind for event in reported[0]]
    for part in ("found", "counts", "fit", "monitoring"):
        assert outcome.summary[part] == whole.summary[part], part
    assert runs[0].finished
