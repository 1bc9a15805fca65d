"""`livebode run --output-only`: what it writes, what other commands do with it, and what it refuses."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.signal import resample_poly

from tests.support.command import livebode, write_parquet
from tests.support.ringing import DAMPING, FREQUENCY_HZ, RATE_HZ, two_modes

SAMPLES = 6000
PART = ("--output-only", "--band", "2:50")


def recording(path: Path, **columns: np.ndarray) -> Path:
    time_s = np.arange(len(next(iter(columns.values())))) / RATE_HZ
    return write_parquet(path, {"t": time_s, **columns})


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    a, b = two_modes(1, SAMPLES, 2)
    rotation = np.sin(2 * np.pi * 38.3 * np.arange(SAMPLES) / RATE_HZ)
    path = tmp_path_factory.mktemp("ringing") / "belt.parquet"
    return recording(path, a=a + rotation, b=b + rotation, flat=np.full(SAMPLES, 2.0), nan=np.full(SAMPLES, np.nan))


@pytest.fixture(scope="module")
def run(log: Path) -> tuple[Path, str]:
    out = log.parent / "run"
    done = livebode("run", log, *PART, "--output", "a", "--output", "b", "--hop", 100, "--window", 2000, "--out", out)
    assert (done.code, done.err) == (0, "")
    return out, done.out


def test_the_run_has_modes_and_harmonics_with_bounds_and_no_responses(run: tuple[Path, str]) -> None:
    out, _ = run
    assert {path.name for path in out.iterdir()} == {
        "run.json", "run-copy.json", "manifest.jsonl", "events.jsonl", "parameters.parquet", "modes.svg",
    }  # fmt: skip
    summary = json.loads((out / "run.json").read_text("utf-8"))
    assert summary["output_only"] is True
    assert [mode["name"] for mode in summary["modes"]] == ["mode 1", "mode 2"]
    for mode, f, z in zip(summary["modes"], FREQUENCY_HZ, DAMPING):
        newest = mode["newest"]
        assert newest["frequency_hz"] == pytest.approx(f, abs=4 * newest["frequency_hz_sigma"])
        assert newest["damping"] == pytest.approx(z, abs=4 * newest["damping_sigma"])
    assert summary["harmonics"][0]["newest"]["frequency_hz"] == pytest.approx(38.3, abs=0.2)
    rows = pq.read_table(out / "parameters.parquet").to_pandas()
    windows = rows[(rows.model == "mode 1") & (rows.name == "frequency")]
    assert len(windows) == summary["counts"]["windows"] == (SAMPLES - 51) // 100 - 19
    assert np.all(np.diff(windows.time_s) == pytest.approx(0.8))
    event = json.loads((out / "events.jsonl").read_text("utf-8").splitlines()[0])
    assert event["kind"] == "harmonic"


def test_no_sentence_calls_the_result_a_plant_or_a_response(run: tuple[Path, str]) -> None:
    out, printed = run
    assert "mode 1: " in printed
    assert re.search(r"harmonic 1: 38\.[23]\d* Hz, constant amplitude and almost no damping: not a mode", printed)
    written = printed + (out / "events.jsonl").read_text("utf-8")
    assert "plant" not in written
    assert "response" not in written


def test_query_and_export_have_the_rows_of_the_modes(run: tuple[Path, str]) -> None:
    out, _ = run
    sql = "SELECT avg(value) FROM parameters WHERE model = 'mode 2' AND name = 'frequency' AND status = 'ok'"
    assert json.loads(livebode("export", out, "--sql", sql, "--json").out)["rows"][0][0] == pytest.approx(47.0, abs=0.5)
    done = livebode("export", out, "--to", "csv", "--parameters")
    assert (done.code, done.err) == (0, "")


@pytest.mark.parametrize(
    "command",
    [
        ("fit", "{run}"),
        ("compare", "{run}", "{run}"),
        ("margins", "{run}"),
        ("view", "{run}"),
        ("export", "{run}", "--to", "csv"),
        ("validate", "{run}", "--on", "{log}"),
        ("learn", "{run}", "--out", "baseline.json"),
    ],
)
def test_what_needs_a_response_is_refused_by_one_sentence(
    run: tuple[Path, str], log: Path, command: tuple[str, ...]
) -> None:
    done = livebode(*(word.format(run=run[0], log=log) for word in command))
    assert done.code == 2
    assert done.err.count("\n") == 1
    assert (
        "is an output-only run: it has modes and no responses; read its table parameters with livebode export"
        in done.err
    )


def test_the_advice_for_a_run_without_responses_works(run: tuple[Path, str], tmp_path: Path) -> None:
    assert livebode("export", run[0], "--sql", "SELECT count(*) FROM parameters").code == 0
    written = livebode("export", run[0], "--to", "csv", "--parameters", "--out", tmp_path / "parameters.csv")
    assert written.code == 0, written.err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--output", "flat"), "channel 'flat' is constant at 2; choose the channel with the signal"),
        (("--output", "nan"), "channel 'nan' is empty: none of its samples is a finite number"),
        (
            ("--output", "a", "--to", "100 samples"),
            "the recording has 100 samples, less than the 120",
        ),
        (("--output", "a", "--window", 5000, "--hop", 1000), "has 5 hops of 1000"),
        (("--output", "a", "--window", 4000, "--from", "3000 samples"), "the recording has 3000 samples, less than"),
        (("--output", "a", "--output", "a"), "or one of them twice"),
        (("--output", "a", "--input", "b"), "signals.input belongs to a response, and an output-only run has none"),
        (("--output", "a", "--average"), "tracking.average belongs to a response"),
        (("--output", "a", "--skip-periods", 1), "source.skip_periods belongs to a response"),
        (("--output", "a", "--from", "2 periods"), "the part is in periods, but without an excitation"),
        (("--output", "a", "--continue"), "record belongs to a response"),
        (("--output", "a", "--serve"), "the dashboard shows responses, and an output-only run has none"),
        (("--output", "a", "--band", "2:80"), "the band 2 … 80 Hz is not between 0 and 50 Hz"),
    ],
)
def test_bad_input_is_one_sentence(log: Path, tmp_path: Path, options: tuple[object, ...], message: str) -> None:
    done = livebode("run", log, *PART, *options, "--out", tmp_path / "run")
    assert done.code == 2
    assert message in done.err
    assert done.err.count("\n") == 1
    assert not (tmp_path / "run").exists()


def test_a_band_replaces_that_of_an_output_only_configuration(log: Path, tmp_path: Path) -> None:
    path = tmp_path / "axis.toml"
    path.write_text(f"[source]\nlog = '{log}'\n[signals]\noutput = 'a'\n[output_only]\nband_hz = [2, 40]\n")
    done = livebode("run", path, "--band", "2:50", "--hop", 200, "--window", 2000, "--out", tmp_path / "run")
    assert done.code == 0, done.err
    assert json.loads((tmp_path / "run" / "run.json").read_text("utf-8"))["found"]["band_hz"] == [2, 50]
    path.write_text(f"[source]\nlog = '{log}'\n[signals]\noutput = 'a'\ninput = 'b'\n")
    refused = livebode("run", path, "--band", "2:50", "--out", tmp_path / "other")
    assert "a band belongs to an output-only run" in refused.err


def test_a_band_needs_an_output_only_run(log: Path) -> None:
    done = livebode("run", log, "--output", "a", "--band", "2:20")
    assert done.code == 2
    assert "a band belongs to an output-only run; remove it, or add --output-only" in done.err


def test_several_recordings_cannot_be_one_output_only_run(log: Path) -> None:
    done = livebode("run", log, log, "--output-only", "--output", "a")
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert "[output_only] (option --output-only) does not apply to several recordings in one run" in done.err


def test_a_live_source_and_several_axes_are_refused_by_one_sentence(log: Path, tmp_path: Path) -> None:
    live = tmp_path / "live.toml"
    live.write_text('output_only = {}\n[source]\nurl = "udp://127.0.0.1:5000"\n[signals]\noutput = "a"\n')
    done = livebode("run", live)
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert "[output_only] needs a recording, but the source is live" in done.err
    axes = tmp_path / "axes.toml"
    one = f'[axes.{{}}]\nsource.log = "{log}"\nsignals.output = "a"\noutput_only = {{{{}}}}\n'
    axes.write_text(one.format("x") + one.format("y"))
    done = livebode("run", axes, "--out", tmp_path / "axes")
    assert done.code == 2
    assert "an axis with [output_only] cannot run together with others; run its recording alone" in done.out + done.err


def test_noise_is_reported_as_no_mode(tmp_path: Path) -> None:
    path = recording(tmp_path / "noise.parquet", y=np.random.default_rng(2).standard_normal(3000))
    done = livebode("run", path, "--output-only", "--output", "y", "--out", tmp_path / "run")
    assert (done.code, done.err) == (0, "")
    found = json.loads((tmp_path / "run" / "run.json").read_text("utf-8"))["found"]
    width_hz = 10 / (np.pi * found["window"] / found["rate_hz"])  # 2ζf, whose decay fits ten times into a window
    assert f"shows resonances wider than {width_hz:.2g} Hz: record longer" in done.out
    assert json.loads((tmp_path / "run" / "run.json").read_text("utf-8"))["modes"] == []


def test_the_default_band_and_the_reduced_rate_find_a_mode_far_below_the_sample_rate(tmp_path: Path) -> None:
    slow = two_modes(3, 2500)[0]
    y = resample_poly(slow, 32, 1) + 1e-3 * np.random.default_rng(3).standard_normal(80_000)
    path = write_parquet(tmp_path / "fast.parquet", {"t": np.arange(80_000) / 4000.0, "y": y})
    done = livebode("run", path, "--output-only", "--output", "y", "--json", "--out", tmp_path / "run")
    summary = json.loads(done.out)
    low_hz, high_hz = summary["found"]["band_hz"]
    assert low_hz < 5
    assert 47 < high_hz < 500
    assert summary["found"]["reduced_rate_hz"] < 1300
    found = [mode["newest"]["frequency_hz"] for mode in summary["modes"]]
    assert min(abs(f - 30.0) for f in found) < 0.5
