"""Recipes with several axes or with the output alone, and what is read how often; on a cluster in this process."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from livebode import ConfigError
from livebode_plant.archive.archive_settings import ArchiveSettings
from livebode_plant.archive.coordinator import ArchiveOutcome, Coordinator, Progress
from livebode_plant.lake import Lake
from livebode_plant.trending import Selection, history
from tests.support import ringing
from tests.support.archives import cluster_here, write_archive, write_recording

AXES = """
[signals]
excitation = "w"
input = "u"
[lines]
frequencies = "20, 40, 60, 100"
window = 400
[tracking]
hop = 400
[fit]
model = "rigid"
[axes.x.signals]
output = "y"
[axes.z.signals]
output = "y2"
"""
BAND = """
[signals]
output = "y"
[output_only]
band_hz = [20.0, 40.0]
"""
FASTER = 2.0


@pytest.fixture
def address() -> Iterator[str]:
    with cluster_here() as address:
        yield address


def run(archive: Path) -> tuple[ArchiveOutcome, dict[str, int]]:
    """Run an archive; the result, and how many recordings each stage had."""
    stages: dict[str, int] = {}

    def report(progress: Progress) -> None:
        stages[progress.stage] = progress.total

    return Coordinator(ArchiveSettings.read(archive), report).run(), stages


def described(folder: Path, address: str, recipe: str, inputs: str) -> Path:
    (folder / "recipe.toml").write_text(recipe)
    archive = folder / "archive.toml"
    archive.write_text(
        f'inputs = ["{inputs}"]\nrecipe = "recipe.toml"\nlake = "lake"\n[cluster]\naddress = "{address}"\n'
    )
    return archive


def test_each_axis_of_a_recording_has_a_result_with_its_own_inertia(tmp_path: Path, address: str) -> None:
    for seed in range(2):
        path = tmp_path / "plant" / f"press {seed}" / "log.parquet"
        path.parent.mkdir(parents=True)
        write_recording(path, seed)
        table = pq.read_table(path)
        pq.write_table(table.append_column("y2", [FASTER * table["y"].to_numpy()]), path)
    archive = described(tmp_path, address, AXES, "plant/{machine}/*.parquet")
    outcome, _ = run(archive)
    assert (outcome.tracked, outcome.quarantined, outcome.unreadable, outcome.remaining) == (4, [], [], 0)
    lake = Lake(str(tmp_path / "lake"))
    inertia = history(lake, "J", Selection(by="axis")).machines
    assert list(inertia) == ["press 0/x", "press 0/z", "press 1/x", "press 1/z"]
    for seed in range(2):
        first, second = (float(inertia[f"press {seed}/{axis}"].value[0]) for axis in "xz")
        assert first == pytest.approx(0.01 + 0.0001 * seed, rel=0.02)
        assert first / second == pytest.approx(FASTER, rel=1e-6)
    again, stages = run(archive)
    assert (again.known, again.tracked, stages) == (2, 0, {})


def test_two_axes_with_the_same_settings_are_refused(tmp_path: Path) -> None:
    same = AXES.replace('"y2"', '"y"')
    with pytest.raises(ConfigError, match="the axes x and z of the recipe have the same settings"):
        Coordinator(ArchiveSettings.read(described(tmp_path, "tcp://127.0.0.1:1", same, "*.parquet")), lambda _: None)


def test_modes_from_the_output_alone_are_quantities_with_a_bound_that_covers(tmp_path: Path, address: str) -> None:
    for seed in range(2):
        (output,) = ringing.two_modes(seed, 6000)
        t = np.arange(len(output)) / ringing.RATE_HZ
        pq.write_table(pa.table({"t": t, "y": output}), tmp_path / f"spindle-{seed}.parquet")
    outcome, _ = run(described(tmp_path, address, BAND, "{machine}.parquet"))
    assert (outcome.tracked, outcome.quarantined) == (2, [])
    lake = Lake(str(tmp_path / "lake"))
    for name, truth in (("frequency", ringing.FREQUENCY_HZ[0]), ("damping", ringing.DAMPING[0])):
        found = history(lake, f"mode 1:{name}", Selection())
        assert list(found.machines) == ["spindle-0", "spindle-1"]
        for machine in found.machines.values():
            assert abs(machine.value[0] - truth) < 2 * machine.bound_95[0]
    rows = lake.read("runs").to_pylist()
    assert [row["responses"] for row in rows] == [0, 0]
    assert all(row["parameters"] > 0 and row["frequencies_hz"] == [] for row in rows)


def test_only_recordings_of_one_length_are_hashed_before_they_are_tracked(tmp_path: Path, address: str) -> None:
    archive = write_archive(tmp_path, 2, address=address)
    plant = tmp_path / "plant"
    longer = plant / "machine-000" / "longer.parquet"
    write_recording(longer, 7, periods=12)
    twins = len({path.stat().st_size for path in plant.rglob("*.parquet")})
    outcome, stages = run(archive)
    assert (outcome.recordings, outcome.tracked, outcome.known) == (4, 3, 1)  # one is a copy
    assert 2 <= stages["reading"] <= 3 < 2 + twins
    assert stages["tracking"] == 3
    for path in plant.rglob("*.parquet"):
        os.utime(path, (1e9, 1e9))  # the lake does not know these versions
    longer.rename(longer.with_name("moved.parquet"))
    outcome, stages = run(archive)
    assert (outcome.recordings, outcome.tracked, outcome.known) == (4, 0, 4)
    assert Lake(str(tmp_path / "lake")).read("runs").num_rows == 3
