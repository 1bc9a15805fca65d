"""Rate, gaps and jitter against recordings whose clock is known."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from livebode.core import RecordingError
from livebode.preparation import inspect
from livebode.sources import Log, open_log
from tests.support.errors import refused

QUICK = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def opened(folder, time, name="t", **options) -> Log:
    pq.write_table(pa.table({name: time, "k": np.arange(len(time), dtype=float)}), folder / "log.parquet")
    return open_log(folder / "log.parquet", **options)


@pytest.mark.parametrize("rate_hz", [4000.0, 2500.0, 1000.0, 12_800.0, 51_200.0, 1 / 0.0003, 1 / 62.5e-6, 44_100.0])
@pytest.mark.parametrize("digits", [7, 9, 17])
def test_the_round_rate_is_found_whatever_the_digits(tmp_path, rate_hz, digits):
    time = np.array([float(f"{k / rate_hz:.{digits}f}") for k in range(20_000)])
    assert opened(tmp_path, time).rate_hz == rate_hz


def test_few_digits_are_rounding_and_not_jitter(tmp_path):
    log = opened(tmp_path, np.round(np.arange(4000) / 4000, 4))
    assert log.rate_hz == 4000
    assert log.timing.gaps == 0


def test_the_rate_of_a_float32_time_column_is_exact(tmp_path):
    assert opened(tmp_path, (np.arange(100_000) / 4000).astype(np.float32)).rate_hz == 4000


def test_a_rate_that_is_not_round_is_not_rounded(tmp_path):
    rate_hz = 1000.0371
    assert opened(tmp_path, np.arange(50_000) / rate_hz).rate_hz == pytest.approx(rate_hz, rel=1e-12)


@QUICK
@given(st.integers(0, 2**32 - 1), st.floats(0, 0.05), st.sampled_from([1.0, 1e-3, 1e-6]))
def test_a_jittering_clock_is_within_its_uncertainty(tmp_path, seed, jitter, scale):
    rng = np.random.default_rng(seed)
    rate_hz, n = float(rng.uniform(100, 20_000)), 2000
    stamps = np.clip(rng.standard_normal(n) * jitter, -0.2, 0.2)
    time = (np.arange(n) + stamps) / rate_hz / scale + 5.0
    log = opened(tmp_path, time, {1.0: "t [s]", 1e-3: "t [ms]", 1e-6: "t [us]"}[scale])
    assert log.rate_hz == pytest.approx(rate_hz, rel=max(1e-9, 12 * jitter / n))
    steps = np.diff(time) * scale
    assert log.timing.period_s_std == pytest.approx(steps.std(), abs=1e-9 / rate_hz + 1e-12)
    assert log.timing.period_s_min == pytest.approx(steps.min())
    assert log.timing.period_s_max == pytest.approx(steps.max())


@QUICK
@given(st.data(), st.integers(1, 300))
def test_gaps_are_counted_wherever_the_blocks_are_cut(tmp_path, data, block_samples):
    lost = data.draw(st.lists(st.tuples(st.integers(10, 990), st.integers(1, 9)), min_size=1, max_size=5))
    mask = np.ones(1000, bool)
    for first, count in lost:
        mask[first : first + count] = False
    mask[[0, 1, -2, -1]] = True
    kept = np.flatnonzero(mask)
    log = opened(tmp_path, kept / 4000)
    blocks = list(log.blocks(["k"], block_samples))
    numbers = np.concatenate([np.arange(block.start, block.stop) for block in blocks])
    np.testing.assert_array_equal(numbers, kept)
    starts = kept[1:][np.diff(kept) > 1].tolist()
    assert [block.start for block in blocks if block.gap] == starts
    assert [gap.sample for gap in log.timing.first_gaps] == starts
    assert log.timing.missing == 1000 - len(kept)
    assert log.rate_hz == 4000


def test_a_pause_need_not_be_whole(tmp_path):
    time = np.concatenate((np.arange(500), 10_000.4 + np.arange(500))) / 1000
    log = opened(tmp_path, time)
    assert log.timing.first_gaps[0].sample == 10_000
    assert log.rate_hz == pytest.approx(1000, rel=1e-9)


@pytest.mark.parametrize(
    ("kind", "factor"), [("int64", 250), (pa.timestamp("us"), 250), (pa.duration("ns"), 250_000), ("uint32", 250)]
)
def test_the_rate_of_an_integer_clock_is_exact(tmp_path, kind, factor):
    array = (
        pa.array(np.arange(3000) * factor)
        .cast(pa.int64())
        .cast(pa.type_for_alias(kind) if isinstance(kind, str) else kind)
    )
    log = opened(tmp_path, array, "time_us" if isinstance(kind, str) else "time")
    assert log.rate_hz == 4000


def test_nanoseconds_since_1970_lose_nothing(tmp_path):
    time = 1_700_000_000_000_000_000 + np.arange(5000, dtype=np.int64) * 250_000
    log = opened(tmp_path, time, "timestamp_ns")
    assert (log.rate_hz, log.timing.period_s_std) == (4000, 0)


def test_a_time_unit_is_derived_from_a_specified_rate(tmp_path):
    time = np.arange(0, 400_000, 400)
    assert opened(tmp_path, time, rate_hz=2500).timing.unit == "us"
    assert open_log(tmp_path / "log.parquet", time="t [us]").rate_hz == 2500
    with refused(RecordingError, "time-unit", channel="t", step=400):
        opened(tmp_path, time)


def test_the_given_rate_is_exact(tmp_path):
    assert opened(tmp_path, np.arange(5000) / 4000.4, rate_hz=4000).rate_hz == 4000


@pytest.mark.parametrize(
    ("spoil", "code", "facts"),
    [
        (lambda t: np.where(np.arange(1000) == 500, np.nan, t), "time-not-finite", {"sample": 500}),
        (lambda t: np.where(np.arange(1000) == 500, t[499], t), "time-not-increasing", {"sample": 500}),
        (lambda t: t + (np.arange(1000) >= 500) * 1.45 / 4000, "time-irregular", {"sample": 500}),
        (lambda t: t + np.random.default_rng(1).uniform(-0.24, 0.24, 1000) / 4000, "time-jitter", {"maximum": 0.1}),
        (
            lambda _: np.array([k + k // 4 for k in range(1000)]) / 4000,
            "time-irregular",
            {"gaps": 249, "samples": 1000},
        ),
        (lambda t: np.round(t, 3), "time-not-increasing", {"sample": 1}),
    ],
)
def test_time_columns_that_are_not_a_clock_are_refused(tmp_path, spoil, code, facts):
    with refused(RecordingError, code, channel="t", path=str(tmp_path / "log.parquet"), **facts):
        opened(tmp_path, spoil(np.arange(1000) / 4000))


def test_a_rate_in_the_metadata_is_used(tmp_path):
    table = pa.table({"u": np.arange(10.0)}).replace_schema_metadata({"rate_hz": "4000"})
    pq.write_table(table, tmp_path / "a.parquet")
    log = open_log(tmp_path / "a.parquet")
    assert (log.rate_hz, log.rate_origin) == (4000, "'rate_hz' in the file")


@pytest.mark.parametrize(
    ("heading", "cells", "rate_hz"),
    [
        ("Fs", ["4000"] * 5, 4000),
        ("fs (kHz)", ["4"] * 5, 4000),
        ("Ts", ["0.00025"] * 5, 4000),
        ("Tvz [ms]", ["0.25", "", "", "", ""], 4000),
        ("Abtastzeit [s]", ["2.5e-4"] * 5, 4000),
    ],
)
def test_a_column_of_one_value_named_as_rate_or_period_gives_the_rate(tmp_path, heading, cells, rate_hz):
    path = tmp_path / "log.csv"
    path.write_text(f"u,{heading}\n" + "".join(f"{k},{cell}\n" for k, cell in enumerate(cells)), encoding="utf-8")
    log = open_log(path)
    assert log.rate_hz == rate_hz
    assert log.rate_origin.startswith(f"column {heading.split()[0]!r} in")
    assert open_log(path, rate_hz=50).rate_hz == 50


@pytest.mark.parametrize(
    "column", ["Ts\n1,2\n2,3\n3,4\n", "Fs [V]\n1,5\n2,5\n3,5\n", "Fs\n1,-5\n2,-5\n", "rate\n1,5\n2,5\n"]
)
def test_a_column_that_is_no_rate_gives_none(tmp_path, column):
    path = tmp_path / "log.csv"
    path.write_text(f"u,{column}", encoding="utf-8")
    with refused(RecordingError, "rate-missing", argument="rate_hz"):
        open_log(path)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("u,v\n1,2\n2,3\n3,5\n", "has neither"),
        ("t,u,v\n0,1,2\n9,2,3\n18,3,5\n", "has no unit"),
        ("t,u,v\n0,1,2\n0,2,3\n0,3,5\n", "repeats"),
    ],
)
def test_inspect_lists_the_channels_of_a_recording_without_a_rate(tmp_path, text, reason):
    path = tmp_path / "log.csv"
    path.write_text(text, encoding="utf-8")
    found = inspect(path)
    plain = found.plain()
    assert [channel["name"] for channel in plain["channels"]][-2:] == ["u", "v"]
    assert (plain["rate_hz"], plain["duration_s"], plain["samples"]) == (None, None, 3)
    assert reason in plain["without_rate"]
    with pytest.raises(RecordingError):
        inspect(path, excitation="u")
