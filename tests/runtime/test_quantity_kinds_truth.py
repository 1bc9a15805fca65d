"""Kinds of quantities decide what a run computes: not the spelling of a unit, and a declared kind before the unit."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pyarrow as pa
import pytest

from livebode import example_axis
from livebode.analysis.fits import fit_run
from livebode.configuration import Axis, FitSection, LoopSection, PIDSection
from livebode.core import Block, Channel, ConfigError, Event, PlantKinds, RecordingError, SourceError, SpectraLayout
from livebode.estimation import Settings, Tracker
from livebode.records import RUN, RunRecord
from livebode.records.summary_file import to_document
from livebode.runtime import Destination, run
from livebode.sources import DeclaredQuantities, open_log
from livebode.sources.live import SourceSettings, SpectraBatch, open_source
from livebode_design.measured_axis import MeasuredAxis, MeasuredSection
from tests.support.command import LINES, signals, write_csv, write_parquet
from tests.support.errors import refused

LOOP = LoopSection(velocity=PIDSection(gain=0.2308, integral_time_s=0.2, rate_hz=4000.0))
NUMBERS = ("value", "sigma", "dof", "coherence", "valid", "distortion", "variation")


@cache
def recorded() -> dict[str, np.ndarray]:
    """A second of a belt axis at standstill: rad/s and N m."""
    block, _ = example_axis(1.0).run()
    return {name: block[name] for name in ("w", "u", "velocity")}


def tracked(
    folder: Path, y: str, u: str, source: Mapping[str, object] = MappingProxyType({}), **fit: object
) -> RunRecord:
    """A run on these samples with units in the headings, and a fit."""
    folder.mkdir(exist_ok=True)
    columns = {"w": recorded()["w"], f"u{u}": recorded()["u"], f"y{y}": recorded()["velocity"]}
    given = {
        "source": {"log": write_parquet(folder / "log.parquet", columns), "rate_hz": 4000.0} | dict(source),
        "signals": {"output": "y", "input": "u", "excitation": "w"},
        "lines": {"frequencies": "20:140:10", "window": 400},
        "tracking": {"average": True, "hop": 100},
        "fit": fit,
    }
    return RunRecord.open(run(Axis.of(given, "test"), Destination(folder / "run", lambda *_: None)).directory)


def parameters(of: RunRecord) -> list[tuple[str, str, float, str]]:
    rows = [row for table in map(pa.table, of.tables("parameters")) for row in table.to_pylist()]
    return [(row["model"], row["name"], row["value"], row["status"]) for row in rows if row["value"] == row["value"]]


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> RunRecord:
    return tracked(tmp_path_factory.mktemp("plain"), " [rad/s]", " [N m]")


@pytest.mark.parametrize(("y", "u"), [(" [rad s^-1]", " [Nm]"), (" [1/s]", " [N·m]"), (" [rad·s⁻¹]", " [kg m²/s²]")])
def test_another_spelling_of_the_units_changes_no_number(tmp_path: Path, plain: RunRecord, y: str, u: str) -> None:
    found = tracked(tmp_path, y, u)
    assert found.kinds == plain.kinds == PlantKinds("velocity", "torque", "rad/s", "N m")
    for name in NUMBERS:
        np.testing.assert_array_equal(getattr(found.responses(), name), getattr(plain.responses(), name))
    assert parameters(found) == parameters(plain)
    assert {row[0] for row in parameters(found)} == {"two-mass"}
    machines = [MeasuredAxis(MeasuredSection(run=run.path), LOOP).machine() for run in (plain, found)]
    assert machines[0].notes == machines[1].notes


def test_declared_kinds_win_over_units_that_say_something_else_or_nothing(tmp_path: Path, plain: RunRecord) -> None:
    declared = {"kinds": {"y": "velocity", "u": "torque"}}
    for name, y, u in (("counts", "counts", "%"), ("wrong", "m", "A"), ("none", "", "")):
        found = tracked(tmp_path / name, y and f" [{y}]", u and f" [{u}]", source=declared)
        assert found.kinds == PlantKinds("velocity", "torque", y, u)
        assert {row[0] for row in parameters(found)} == {"two-mass-gain"}  # one of these units is not known in SI units
    stated = {"units": {"y": "rad/s", "u": "N m"}}
    for name, y, u in (("counts", " [counts]", " [%]"), ("wrong", " [m]", " [A]"), ("none", "", "")):
        found = tracked(tmp_path / f"stated {name}", y, u, source=stated)
        assert found.kinds == plain.kinds
        assert parameters(found) == parameters(plain)


def test_an_unknown_kind_of_the_output_names_the_key_before_anything_is_written(tmp_path: Path) -> None:
    with refused(ConfigError, "kind-needed", key="source.kinds", value="other", allowed=["velocity", "position"]):
        tracked(tmp_path, " [counts]", " [N m]")
    assert not (tmp_path / "run").exists()
    with refused(ConfigError, "kind-needed", value="acceleration"):
        tracked(tmp_path, " [rad/s²]", " [N m]")
    named = tracked(tmp_path, " [counts]", " [N m]", output="velocity")
    assert {row[0] for row in parameters(named)} == {"two-mass-gain"}
    with refused(ConfigError, "kind-needed", key="measured.output", value="other"):
        MeasuredAxis(MeasuredSection(run=named.path), LOOP).machine()
    noted = MeasuredAxis(MeasuredSection(run=named.path, output="velocity"), LOOP).machine().notes
    assert any("the run's plant is in counts/(N m)" in note for note in noted)


@pytest.mark.parametrize("kind", ["speed", "Velocity", "", 1, ["velocity"]])
def test_a_kind_that_does_not_exist_is_rejected_with_those_that_do(kind: object) -> None:
    data = {"source": {"log": "a.csv", "kinds": {"y": kind}}, "signals": {"output": "y"}}
    with pytest.raises(ConfigError, match=r"source\.kinds\.y = .* 'torque', 'force', 'current', 'velocity'"):
        Axis.of(data, "axis.toml")


def test_a_kind_for_a_channel_that_does_not_exist_names_the_nearest(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "log.csv", signals(200))
    with refused(RecordingError, "channel-unknown", channel="yy"):
        open_log(path, kinds={"yy": "velocity"})
    with refused(SourceError, "channel-unknown", channel="yy"):
        open_source(SourceSettings(log=path, follow=True, kinds={"yy": "velocity"}))


def test_the_samples_of_every_source_carry_the_declared_kind(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "log.csv", signals(200))
    log = open_log(path, kinds={"y": "acceleration"})
    kinds = {channel.name: channel.kind for channel in next(log.blocks()).channels}
    assert kinds == {channel.name: channel.kind for channel in log.channels if channel.name != "t"}
    assert kinds["y"] == "acceleration"
    with open_source(SourceSettings(log=path, follow=True, kinds={"y": "acceleration"})) as source:
        block = next(source.blocks(["u", "y"]))
    assert [channel.kind for channel in block.channels] == ["other", "acceleration"]
    assert {channel.kind for channel in source.channels} == {"other", "acceleration"}


def test_the_steps_of_a_sensor_are_those_of_the_position_behind_a_velocity() -> None:
    """A velocity that a drive computes from the steps of an encoder moves by these steps times |1 − 1/z| at a line.

    Position: one step of amplitude at each line, above the limit of half a step. Velocity: 2 sin(pi f/rate) steps, at
    50 Hz 0.31, which would be too little for a signal that moves in such steps itself.
    """
    n, step, rng = np.arange(4000), 0.5, np.random.default_rng(3)
    angles = 2 * np.pi * np.outer(LINES.frequency_hz, n) / LINES.rate_hz
    w, position = np.sin(angles).sum(axis=0), step * np.cos(angles).sum(axis=0)
    velocity = np.diff(step * np.round((position + 0.3 * step * rng.standard_normal(n.size)) / step), prepend=0.0)

    events: list[Event] = []

    def without_steps(*unit: str) -> list[bool]:
        settings = Settings(lines=LINES, output="y", input="u", excitation="w")
        channels = Channel("w"), Channel("u"), Channel("y", *unit)  # type: ignore[arg-type]
        events.clear()
        found = Tracker(settings).process(Block(np.array([w, w, velocity]), channels, LINES.rate_hz), events.append)
        return found.valid[-1].tolist()

    of_velocity = [without_steps("rad/s"), without_steps("rpm"), without_steps("counts", "velocity"), without_steps()]
    assert of_velocity == [[True, True, True]] * 4
    assert events == []
    hint = "if the output is a velocity, declare it in source.kinds"
    for unit in (("rad",), ("counts",), ("rad/s", "position")):
        assert without_steps(*unit) == [False, True, True]
        (event,) = events
        assert (event.kind, hint in event.message) == ("steps", unit == ("counts",))


def test_a_run_without_recorded_kinds_is_read_by_its_unit(plain: RunRecord) -> None:
    older = json.loads((plain.path / RUN).read_text())
    del older["found"]["kinds"]
    (plain.path / RUN).write_bytes(to_document({name: part for name, part in older.items() if name != "crc32"}))
    assert RunRecord.open(plain.path).kinds == PlantKinds("velocity", "torque", "rad/s", "N m")
    assert fit_run(plain.path, FitSection())[0].asked.name == "two-mass"


def test_spectra_of_a_drive_carry_the_declared_kind() -> None:
    layout = SpectraLayout((Channel("u", "A"), Channel("y", "counts")), (Channel("y", "counts"),), 100, 20, LINES.bins)
    sums = np.ones((2, 1, len(LINES)), dtype=np.complex128)
    batch = SpectraBatch(0, sums, np.zeros((1, 1)), np.zeros(1, dtype=np.uint32), layout, 1000.0)
    assert [channel.kind for channel in batch.channels] == ["current", "other"]
    block = batch.in_si(DeclaredQuantities({"y": "velocity"})).block(0, 0, False)
    assert [(channel.name, channel.kind) for channel in block.channels] == [("u", "current"), ("y", "velocity")]
