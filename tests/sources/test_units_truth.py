"""A servo in the units of any drive: the same samples in SI units, and the same parameters of the machine."""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Mapping
from math import pi
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from livebode.analysis import averaged, fit_averaged, fit_remarks
from livebode.arrays import Floats
from livebode.configuration import Axis, FitSection
from livebode.core import Channel, ConfigError, SpectraLayout, UsageError
from livebode.fitting import Fit
from livebode.records import RunRecord
from livebode.runtime import Destination, run
from livebode.sources import DeclaredQuantities, open_log
from livebode.sources.live import Batch, SourceSettings, SpectraBatch, encode_line, open_source
from livebode.sources.quantities import kind_by_name, unit_by_name
from tests.support.command import write_parquet
from tests.support.drive_exports import (
    COUNTS,
    EXPORTS,
    RPM,
    SERVO,
    TRUTH,
    Export,
    T,
    servo,
)
from tests.support.errors import refused
from tests.support.real_recordings import recording


def fitted(folder: Path, path: Path, names: tuple[str, str, str], source: Mapping[str, object], **fit: object) -> Fit:
    """A run on this recording, and the fit of its mean with the defaults; its remarks are in `REMARKS`."""
    excitation, torque, output = names
    given = {
        "source": {"log": path} | dict(source),
        "signals": {"excitation": excitation, "input": torque, "output": output},
        "fit": fit,
    }
    found = run(Axis.of(given, "test"), Destination(folder, lambda *_: None))
    average = averaged(RunRecord.open(found.directory))
    section = FitSection.model_validate(fit)
    result, _ = fit_averaged(average, section)
    REMARKS[:] = fit_remarks(average, section, result, output)
    assert found.summary["fit"]["unknown_gain"] == next((one for one in REMARKS if "gain is unknown" in one), "")
    return result


REMARKS: list[str] = []


def values(of: Fit) -> dict[str, float]:
    assert of.status == "ok", of.sentence
    return {name: value for name, value, _, _ in of.rows()}


@pytest.fixture(scope="module")
def in_si(tmp_path_factory: pytest.TempPathFactory) -> dict[str, float]:
    folder = tmp_path_factory.mktemp("SI")
    export = EXPORTS["SI"]
    return values(fitted(folder / "run", export.write(folder / "log.csv"), export.names, {}))


def test_the_parameters_in_si_units_are_those_of_the_machine(in_si: dict[str, float]) -> None:
    for name, true in TRUTH.items():
        assert in_si[name] == pytest.approx(true, rel=2e-3)


@pytest.mark.parametrize("name", EXPORTS)
def test_the_same_machine_in_the_units_of_any_drive_has_the_same_parameters(
    name: str, tmp_path: Path, in_si: dict[str, float]
) -> None:
    export = EXPORTS[name]
    found = fitted(tmp_path / "run", export.write(tmp_path / "log.csv"), export.names, {"units": dict(export.units)})
    assert found.asked is not None
    assert found.asked.name == "two-mass"
    assert values(found) == pytest.approx(in_si, rel=1e-6)


def test_a_linear_motor_has_masses_in_kilograms(tmp_path: Path, in_si: dict[str, float]) -> None:
    """The same numbers with a force in N and a speed in mm/s."""
    export = Export(T, ("w [N]", 1), ("Kraft [N]", 1), ("v [mm/s]", 1e3))
    found = fitted(tmp_path / "run", export.write(tmp_path / "log.csv"), export.names, {})
    rows = {name: (value, unit) for name, value, _, unit in found.rows()}
    assert rows["Js"] == (pytest.approx(in_si["Js"], rel=1e-6), "kg")
    assert rows["mL"] == (pytest.approx(in_si["JL"], rel=1e-6), "kg")
    assert rows["Keff"] == (pytest.approx(in_si["Keff"], rel=1e-6), "N/m")
    turned = Export(T, ("w [N]", 1), ("Kraft [N]", 1), ("n [rpm]", RPM))
    gain = fitted(tmp_path / "gain", turned.write(tmp_path / "turned.csv"), turned.names, {})
    assert gain.rows()[0][3] == "rad/s²/N"
    assert any("'Kraft' is in N; a force drives masses only if the output is in m or m/s" in one for one in REMARKS)


def test_counts_of_an_encoder_give_the_machine_within_their_steps(tmp_path: Path) -> None:
    export = Export(
        T, ("exc_Nm", 1), ("torque_Nm", 1), ("position_counts", COUNTS), {"position_counts": "1/1048576 rev"}, True
    )
    path = export.write(tmp_path / "log.csv")
    found = values(fitted(tmp_path / "run", path, export.names, {"units": dict(export.units)}))
    for name, true in TRUTH.items():
        assert found[name] == pytest.approx(true, rel=2e-2)
    unknown = fitted(tmp_path / "unknown", path, export.names, {})
    assert unknown.rows()[0][3] == "counts/s²/(N m)"


TORQUES = {"N m": 1, "Nm": 1, "mNm": 1e3, "Ncm": 1e2, "kN·m": 1e-3, "N mm": 1e3, "牛米": 1}
SPEEDS = {
    "rad/s": 1, "1/s": 1, "rpm": RPM, "1/min": RPM, "min⁻¹": RPM, "min-1": RPM, "U/min": RPM, "r/min": RPM,
    "转/分": RPM, "rev/s": 1 / (2 * pi), "°/s": 180 / pi, "Grad/s": 180 / pi, "mdeg/s": 180e3 / pi, "mrad/s": 1e3,
}  # fmt: skip
SUFFIXES = {"": "", "speed_rpm": "rpm", "speed_deg_s": "deg/s", "n_1_min": "1/min", "Istdrehzahl rpm": "rpm"}


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.sampled_from(sorted(TORQUES)), st.sampled_from(sorted(SPEEDS)))
def test_any_recognised_units_give_the_same_parameters(
    tmp_path_factory: pytest.TempPathFactory, in_si: dict[str, float], torque: str, speed: str
) -> None:
    folder, of = tmp_path_factory.mktemp("units"), servo()
    columns = {"w": of["w"], f"u [{torque}]": TORQUES[torque] * of["u"], f"y [{speed}]": SPEEDS[speed] * of["y"]}
    path = write_parquet(folder / "log.parquet", columns)
    found = values(fitted(folder / "run", path, ("w", "u", "y"), {"rate_hz": SERVO.rate_hz}))
    assert found == pytest.approx(in_si, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "gain", "unit"),
    [
        ("% of the rated torque", 0.024 / (SERVO.motor + SERVO.load), "rad/s²/%"),
        ("torque constant", 0.35 / (SERVO.motor + SERVO.load), "rad/s²/A"),
        ("without units", 1e-3 / (SERVO.motor + SERVO.load), "output units/s per input unit"),
    ],
)
def test_a_gain_that_is_not_known_has_its_own_unit_and_the_remedy_that_is_named_works(
    name: str, gain: float, unit: str, tmp_path: Path
) -> None:
    export = EXPORTS[name]
    path = export.write(tmp_path / "log.csv")
    found = fitted(tmp_path / "run", path, export.names, {})
    assert found.asked is not None
    assert found.asked.name == "two-mass-gain"
    (_, value, _, shown), *others = found.rows()
    assert shown == unit
    assert value == pytest.approx(gain, rel=2e-3)
    assert {row[0]: row[1] for row in others}["resonance"] == pytest.approx(SERVO.resonance_hz, rel=1e-3)
    (remark,) = (one for one in REMARKS if "the gain is unknown" in one)
    remedy = tomllib.loads(remark.partition("as in ")[2])
    assert export.names[1] in remedy["units"]
    known = fitted(tmp_path / "known", path, export.names, remedy)
    assert known.asked is not None
    assert known.asked.name == "two-mass"
    assert not any("unknown" in one for one in REMARKS)


def test_a_model_in_si_units_of_a_torque_in_percent_is_refused_with_the_remedy(tmp_path: Path) -> None:
    for name in ("% of the rated torque", "torque constant"):
        export = EXPORTS[name]
        path = export.write(tmp_path / "log.csv")
        with refused(ConfigError, "unit-not-si", key="fit.model", value="two-mass") as caught:
            fitted(tmp_path / "run", path, export.names, {}, model="two-mass")
        del caught
        assert not (tmp_path / "run").exists()


def test_a_channel_knows_its_unit_in_the_file(tmp_path: Path) -> None:
    log = open_log(EXPORTS["German"].write(tmp_path / "log.csv"))
    assert [(c.unit, c.source_unit, round(c.factor, 6)) for c in log.channels[1:]] == [
        ("N m", "Ncm", 0.01), ("N m", "Nm", 1.0), ("rad/s", "U/min", 0.10472),
    ]  # fmt: skip
    export = EXPORTS["without units"]
    stated = open_log(export.write(tmp_path / "stated.csv"), units=dict(export.units))
    assert [(c.unit, c.source_unit, c.factor) for c in stated.channels[2:]] == [
        ("N m", "mNm", 1e-3), ("rad/s", "rad/s", 1.0),
    ]  # fmt: skip
    raw = np.concatenate([block.data for block in log.as_written().blocks(["Istdrehzahl"])], axis=1)
    read = np.concatenate([block.data for block in log.blocks(["Istdrehzahl"])], axis=1)
    np.testing.assert_allclose(read, raw * pi / 30, rtol=1e-15)


def test_an_expression_computes_with_si_units_and_its_own_unit_is_converted(tmp_path: Path) -> None:
    log = open_log(EXPORTS["German"].write(tmp_path / "log.csv"))
    texts = ["-Istdrehzahl", "9.549296585513721*Istdrehzahl [1/min]", "0.5*Solldrehmoment - 0.5*Anregung"]
    y, same, half = np.concatenate([block.data for block in log.blocks(texts)], axis=1)
    np.testing.assert_allclose(y, -servo()["y"], atol=1e-9)
    np.testing.assert_allclose(same, servo()["y"], atol=1e-9)
    np.testing.assert_allclose(half, (servo()["u"] - servo()["w"]) / 2, atol=1e-9)
    assert [channel.unit for channel in log.naming(texts).channels[-3:]] == ["rad/s", "rad/s", "N m"]


def test_a_live_source_is_converted_as_a_recording_is(tmp_path: Path) -> None:
    """Lines of a sender, a table that grows, and a directory of recordings."""
    export = EXPORTS["% of the rated torque"]
    units = dict(export.units)
    (tmp_path / "folder").mkdir()
    path = export.write(tmp_path / "folder" / "log.csv")
    names = list(export.names)
    expected = np.concatenate([block.data for block in open_log(path, units=units).blocks(names)], axis=1)
    np.testing.assert_allclose(expected, [servo()[name] for name in "wuy"], atol=1e-9)

    def read(settings: SourceSettings) -> Floats:
        data: list[Floats] = []
        with open_source(settings) as source:
            assert [channel.unit for channel in source.channels if channel.name in names] == ["N m", "N m", "rad/s"]
            for block in source.blocks(names):
                data.append(block.data)
                if sum(part.shape[1] for part in data) >= expected.shape[1]:
                    source.stop()
        return np.concatenate(data, axis=1)

    for place in (path, tmp_path / "folder"):
        np.testing.assert_array_equal(read(SourceSettings(log=place, follow=True, units=units)), expected)
    channels = tuple(Channel(c.name, c.source_unit) for c in open_log(path).channels[1:])
    raw = np.concatenate([block.data for block in open_log(path).as_written().blocks(names)], axis=1)
    (tmp_path / "lines").write_bytes(
        b"".join(
            encode_line(Batch(at, raw[:, at : at + 500], channels, SERVO.rate_hz)) for at in range(0, raw.shape[1], 500)
        )
    )
    with (tmp_path / "lines").open("rb") as lines, mock.patch.object(sys, "stdin", lines):
        np.testing.assert_allclose(read(SourceSettings(url="stdin:", units=units)), expected, rtol=1e-9, atol=1e-12)


def test_samples_that_were_recorded_in_si_units_are_replayed_as_they_are(tmp_path: Path) -> None:
    export = EXPORTS["torque constant"]
    excitation, torque, output = export.names
    given = {
        "source": {"log": export.write(tmp_path / "log.csv"), "units": dict(export.units)},
        "signals": {"excitation": excitation, "input": torque, "output": output},
        "record": {"samples": True},
    }
    first = run(Axis.of(given, "test"), Destination(tmp_path / "run", lambda *_: None))
    found = RunRecord.open(first.directory)
    lines = {"frequencies": ",".join(f"{f:g}" for f in found.lines.frequency_hz), "window": found.lines.window}
    again = given | {
        "source": {"replay": tmp_path / "run", "units": dict(export.units)},
        "lines": lines,
        "tracking": {"hop": found.summary["found"]["hop"]},
    }
    second = RunRecord.open(run(Axis.of(again, "test"), Destination(tmp_path / "again", lambda *_: None)).directory)
    assert second.kinds == found.kinds
    assert np.nanmean(np.abs(second.responses().value)) == pytest.approx(
        np.nanmean(np.abs(found.responses().value)), rel=1e-3
    )


def test_spectra_of_a_drive_are_converted_with_what_they_are_of() -> None:
    layout = SpectraLayout(
        (Channel("u", "%"), Channel("y", "rpm")), (Channel("x", "mm"),), 100, 20, (2, 5), (), (3.0, 60.0)
    )
    sums = np.asarray(np.arange(8.0).reshape(2, 2, 2) + 1j, dtype=np.complex128)
    batch = SpectraBatch(0, sums, np.array([[5.0, 7.0]]), np.zeros(2, dtype=np.uint32), layout, 1000.0)
    found = batch.in_si(DeclaredQuantities(units={"u": "0.024 N m"}))
    assert [channel.unit for channel in found.channels] == ["N m", "rad/s", "m"]
    np.testing.assert_allclose(found.sums, sums * np.array([0.024, pi / 30])[:, np.newaxis, np.newaxis])
    np.testing.assert_allclose(found.values, [[0.005, 0.007]])
    assert found.layout.subtracted == pytest.approx((0.072, 2 * pi))
    np.testing.assert_array_equal(found.in_si(DeclaredQuantities()).sums, found.sums)


@pytest.mark.parametrize(
    ("name", "kind", "unit"),
    [
        ("Solldrehmoment", "torque", ""), ("Istdrehzahl", "velocity", ""), ("转矩", "torque", ""),
        ("转速", "velocity", ""),
        ("Actual speed", "velocity", ""), ("Motorstrom", "current", ""), ("加速度", "acceleration", ""),
        ("axis_A", None, ""), ("theta_m", None, ""), ("torque_m", "torque", ""), ("x_m", None, ""),
        ("status_A", None, ""), ("pos_m", "position", "m"), ("load_pct", None, "%"), ("cabinet_temp_deg", None, ""),
        ("speed_rad_s", "velocity", "rad/s"), ("v_mm_s", None, "mm/s"), ("torque_nm", "torque", "N m"),
    ],
)  # fmt: skip
def test_a_name_gives_kind_and_unit_only_if_it_says_so(name: str, kind: str | None, unit: str) -> None:
    assert (kind_by_name(name), unit_by_name(name)) == (kind, unit)


@pytest.mark.parametrize(
    ("head", "encoding"),
    [
        ("Zeit;Sollmoment;Istdrehzahl;Lage\n[s];[Nm];[1/min];[°]", "cp1252"),
        ("Zeit;Sollmoment;Istdrehzahl;Lage\ns;Nm;U/min;Grad", "utf-8"),
        ("t/s;M/Nm;n/min-1;phi/Grad", "utf-8"),
        ("t in s;M in Nm;n in 1/min;phi in °", "latin-1"),
        ("Time(s);Torque(Nm);Speed(rpm);Position(deg)", "utf-8"),
        ("Time, s;Torque, N·m;Speed, rpm;Position, deg", "cp1252"),
        ("时间(秒);转矩(N·m);转速(转/分);位置(度)", "gb18030"),
        ("t_s;TorqueNm;MotorSpeedRPM;pos_deg", "utf-8"),
    ],
)
def test_units_are_found_wherever_a_drive_writes_them(head: str, encoding: str, tmp_path: Path) -> None:
    rows = "".join(f"{i / 1000:.3f};{i % 7};{i % 5};{i * i % 11}\n" for i in range(50)).replace(".", ",")
    path = tmp_path / "log.csv"
    path.write_bytes(f"{head}\n{rows}".encode(encoding))
    log = open_log(path)
    assert log.rate_hz == 1000
    assert [(channel.unit, channel.factor) for channel in log.channels[1:]] == [
        ("N m", 1.0), ("rad/s", pytest.approx(pi / 30)), ("rad", pytest.approx(pi / 180)),
    ]  # fmt: skip


@pytest.mark.parametrize("unit", ["0.024 foo", "0 N m", "1/0 rev", "1e400 N m", "-2 N m"])
def test_a_quantity_that_is_none_is_refused_before_anything_is_read(unit: str) -> None:
    with refused(UsageError, "unreadable", argument="units", channel="u", value=unit):
        DeclaredQuantities(units={"u": unit})
    with pytest.raises(ConfigError, match=r"source\.units"):
        Axis.of({"source": {"log": "a.csv", "units": {"u": unit}}, "signals": {"output": "y"}}, "axis.toml")


def test_a_real_motor_bench_exported_by_a_german_drive_has_the_same_parameters(tmp_path: Path) -> None:
    """The angle in rad and iq in A, written in degrees and as % of 20 A."""
    path = recording("motorbench/MultisineTypeA.mat")
    names, begin = ("iq_refx", "iq_adx", "theta_mx"), {"from": "7500 samples"}
    log = open_log(path)
    w, u, y = np.concatenate([block.data for block in log.blocks(names)], axis=1)
    columns = {"Anregung": w, "Stromistwert [%]": u * 5, "Istlage [Grad]": y * 180 / pi}
    exported = write_parquet(tmp_path / "log.parquet", columns)
    units = {"iq_adx": "0.05 N m", "theta_mx": "rad"}
    direct = fitted(tmp_path / "direct", path, names, begin | {"units": units})
    drive = fitted(
        tmp_path / "drive", exported, ("Anregung", "Stromistwert", "Istlage"),
        begin | {"rate_hz": log.rate_hz, "units": {"Stromistwert": "0.01 N m"}},
    )  # fmt: skip
    assert values(drive) == pytest.approx(values(direct), rel=1e-4)
    assert values(drive)["resonance"] == pytest.approx(76.2, rel=0.01)
    assert values(drive)["antiresonance"] == pytest.approx(53.9, rel=0.01)
