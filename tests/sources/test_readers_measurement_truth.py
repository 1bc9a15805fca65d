"""TDMS and MDF as LabVIEW and measurement systems write them: units, rates, groups, marks of invalid samples."""

from __future__ import annotations

import asammdf
import nptdms
import numpy as np
import pytest

from livebode.core import RecordingError
from livebode.sources import open_log
from tests.support.errors import refused

RATE_HZ = 4000.0
VALUES = np.random.default_rng(0).standard_normal(500)


def test_tdms_waveforms_bring_rate_and_unit(tmp_path):
    waveform = {"wf_increment": 1 / RATE_HZ, "wf_start_offset": 0.0, "unit_string": "A"}
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as file:
        file.write_segment([nptdms.ChannelObject("drive", name, VALUES * k, waveform) for k, name in enumerate("uvw")])
    log = open_log(tmp_path / "a.tdms")
    assert (log.rate_hz, log.rate_origin, log.samples) == (RATE_HZ, "metadata", 500)
    assert [(c.name, c.unit) for c in log.channels] == [("u", "A"), ("v", "A"), ("w", "A")]
    (block,) = log.blocks(["w", "drive/u"])
    np.testing.assert_array_equal(block.data, [2 * VALUES, 0 * VALUES])


def test_tdms_groups_are_paths_and_moments_are_time(tmp_path):
    time = np.datetime64("2024-01-01T00:00:00") + np.arange(500) * np.timedelta64(250, "us")
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as file:
        file.write_segment(
            [
                nptdms.ChannelObject("a", "time", time),
                nptdms.ChannelObject("a", "u", VALUES.astype(np.float32)),
                nptdms.ChannelObject("b", "u", np.arange(500, dtype=np.int16)),
                nptdms.ChannelObject("b", "y", VALUES),
                nptdms.ChannelObject("b", "note", ["x"] * 500),
            ]
        )
    log = open_log(tmp_path / "a.tdms")
    assert log.rate_hz == RATE_HZ
    assert [c.name for c in log.channels] == ["a/u", "b/u", "b/y"]
    assert log.aliases == {"time": "a/time", "y": "b/y"}
    assert [skipped.name for skipped in log.skipped] == ["b/note"]
    (block,) = log.blocks(["b/u", "y"])
    np.testing.assert_array_equal(block.data, [np.arange(500), VALUES])


def test_a_tdms_file_that_ends_early_is_refused(tmp_path):
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as file:
        file.write_segment([nptdms.ChannelObject("a", "u", VALUES)])
    raw = (tmp_path / "a.tdms").read_bytes()
    (tmp_path / "b.tdms").write_bytes(raw[:-8])
    with refused(RecordingError, "truncated", path=str(tmp_path / "b.tdms"), missing_bytes=8):
        open_log(tmp_path / "b.tdms", rate_hz=RATE_HZ)


@pytest.mark.parametrize("version", ["4.10", "3.30"])
def test_mdf_brings_units_and_physical_values(tmp_path, version):
    time = np.arange(500) / RATE_HZ
    scaled = asammdf.Signal(np.arange(500, dtype=np.int16), time, name="i", unit="A", conversion={"a": 0.01, "b": -1.0})
    with asammdf.MDF(version=version) as file:
        file.append([scaled, asammdf.Signal(VALUES, time, name="y", unit="rad/s")], common_timebase=True)
        path = file.save(tmp_path / "a", overwrite=True)
    log = open_log(path)
    assert log.rate_hz == RATE_HZ
    assert {c.name: c.unit for c in log.channels if c.name not in ("time", "t")} == {"i": "A", "y": "rad/s"}
    (block,) = log.blocks(["i", "y"])
    np.testing.assert_allclose(block["i"], np.arange(500) * 0.01 - 1, rtol=1e-15, atol=1e-15)
    np.testing.assert_array_equal(block["y"], VALUES)


def test_mdf_groups_of_two_rates_are_separated(tmp_path):
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(VALUES, np.arange(500) / RATE_HZ, name="y")], common_timebase=True)
        file.append([asammdf.Signal(VALUES[:50], np.arange(50) / 400, name="y")], common_timebase=True)
        path = file.save(tmp_path / "a.mf4", overwrite=True)
    log = open_log(path)
    assert (log.rate_hz, log.samples) == (RATE_HZ, 500)
    assert "0/y" in [c.name for c in log.channels]
    assert log.other_clocks == {"1/time": ("1/y",)}
    assert open_log(path, time="1/time").rate_hz == 400


def test_samples_that_mdf_marks_as_invalid_are_nan(tmp_path):
    invalid = np.zeros(500, dtype=bool)
    invalid[[3, 400]] = True
    signal = asammdf.Signal(VALUES, np.arange(500) / RATE_HZ, name="y", invalidation_bits=invalid)
    with asammdf.MDF(version="4.10") as file:
        file.append([signal], common_timebase=True)
        path = file.save(tmp_path / "a.mf4", overwrite=True)
    (block,) = open_log(path).blocks(["y"])
    np.testing.assert_array_equal(block["y"], np.where(invalid, np.nan, VALUES))
