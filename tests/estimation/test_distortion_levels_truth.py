"""Even and odd distortion from one realisation of odd lines: the levels are those of the nonlinearity."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from livebode.core import Block, Event, Lines, PrintedTable
from livebode.estimation import Settings, SuccessiveTrackers, Tracker
from livebode.estimation.levels import Level, detection_bins
from livebode.excitation import multisine, odd_lines
from livebode_reports.run_report import run_report
from tests.support.command import livebode, write_parquet

RATE_HZ, WINDOW, PERIODS = 1000.0, 500, 16
LINES = odd_lines(5, 200, RATE_HZ, WINDOW, seed=1)
EVEN, ODD = detection_bins(LINES)
NOISE = 1e-3


def period(seed: int) -> np.ndarray:
    w = multisine(LINES, 1.0, np.random.default_rng(seed).uniform(0, 2 * np.pi, len(LINES)))
    return np.asarray(w / w.std())


def record(even: float, odd: float, seed: int = 0, noise: float = NOISE) -> dict[str, np.ndarray]:
    """Periods of y = 2·u + even·u² + odd·u³ + noise with u = w."""
    u = np.tile(period(seed), PERIODS)
    y = 2 * u + even * u**2 + odd * u**3 + noise * np.random.default_rng([seed, 1]).standard_normal(u.size)
    return {"w": u, "u": u, "y": y}


def tracked(columns: dict[str, np.ndarray], **options: object) -> tuple[dict[str, Level | None], list[Event]]:
    settings = {"excitation": "w", "input": "u", "output": "y", "hop": WINDOW} | options
    tracker, events = Tracker(Settings(lines=LINES, **settings)), []  # type: ignore[arg-type, var-annotated]
    block = Block(np.array(list(columns.values())), tuple(columns), RATE_HZ)
    for part in (block.cut(0, 1333), block.cut(1333, len(block))):
        tracker.process(part)
    tracker.finish(events.append)
    assert tracker._repeating is not None
    return tracker._repeating.levels.levels(), events


def expected_db(part: np.ndarray, whole: np.ndarray, bins: np.ndarray) -> float:
    at_lines = np.fft.rfft(whole)[list(LINES.bins)]
    return float(10 * np.log10(np.mean(np.abs(np.fft.rfft(part)[bins]) ** 2) / np.mean(np.abs(at_lines) ** 2)))


@pytest.mark.parametrize(("even", "odd"), [(0.01, 0.0), (0.0, 0.003), (0.01, 0.003)])
def test_squares_and_cubes_have_the_levels_of_their_spectra(even: float, odd: float) -> None:
    u = period(0)
    levels, events = tracked(record(even, odd))
    for kind, bins, factor, part in (("even", EVEN, even, even * u**2), ("odd", ODD, odd, odd * u**3)):
        level = levels[kind]
        assert level is not None
        assert (level.bins, level.significant) == (bins.size, factor > 0)
        if factor:
            # The cube changes the gain, and the interpolation of it between the lines has an error.
            assert level.db == pytest.approx(expected_db(part, 2 * u + even * u**2 + odd * u**3, bins), abs=0.3)
        else:
            assert level.bound_db[1] < -80
        noise_db = 10 * np.log10(NOISE**2 / PERIODS / 4 * len(LINES) / (WINDOW / 2))
        assert level.noise_db == pytest.approx(noise_db, abs=1.0)
    (event,) = events
    assert event.kind == "distortion-levels"


def test_the_bounds_cover_the_level_of_its_phases() -> None:
    """95 % of 50 records: fewer than 42 happen by chance less than once in 500."""
    covered = 0
    for seed in range(50):
        u = period(seed)
        columns = record(0.0, 0.003, seed, 0.006)
        level = tracked({name: x[: 5 * WINDOW] for name, x in columns.items()})[0]["odd"]
        assert level is not None
        truth_db = expected_db(0.003 * u**3, 2 * u + 0.003 * u**3, ODD)
        covered += level.bound_db[0] < truth_db < level.bound_db[1]
    assert covered >= 42


def test_noise_alone_is_no_distortion() -> None:
    """One in 1,000 of each kind: more than two of 40 records happen by chance less than once in 10,000."""
    found = [tracked({name: x[: 4 * WINDOW] for name, x in record(0, 0, seed, 0.1).items()})[1] for seed in range(40)]
    assert sum(map(bool, found)) <= 2


def test_a_pause_or_another_phase_does_not_change_the_levels() -> None:
    u = np.concatenate([np.tile(period(0), 8), np.zeros(WINDOW), np.tile(np.roll(period(0), 77), 8)])
    y = 2 * u + 0.01 * u**2 + NOISE * np.random.default_rng(5).standard_normal(u.size)
    level = tracked({"w": u, "u": u, "y": y})[0]["even"]
    assert level is not None
    assert level.db == pytest.approx(expected_db(0.01 * period(0) ** 2, 2 * period(0), EVEN), abs=0.3)


def test_a_line_without_excitation_has_no_levels_beside_it() -> None:
    part = Lines.of_bins([k for k in LINES.bins if k != LINES.bins[20]], WINDOW, RATE_HZ)
    u = np.tile(multisine(part, 1.0, "schroeder"), 8)
    level = tracked({"w": u, "u": u, "y": 2 * u + 0.001 * u**2})[0]["even"]
    assert level is not None
    assert EVEN.size - 8 < level.bins < EVEN.size


def test_distortion_that_feedback_returned_is_subtracted() -> None:
    w = np.tile(period(2), PERIODS)
    y = (2 * w + 0.01 * w**2) / (1 + 2 * 0.5)  # y = 2·u + 0.01·w², u = w − y/2
    level = tracked({"w": w, "u": w - 0.5 * y, "y": y})[0]["even"]
    assert level is not None
    assert level.db == pytest.approx(expected_db(0.01 * period(2) ** 2, y[:WINDOW], EVEN), abs=0.01)


def test_the_levels_of_several_recordings_are_those_of_their_mean_power() -> None:
    settings = Settings(lines=LINES, excitation="w", input="u", output="y", hop=WINDOW)
    trackers, size = [Tracker(settings) for _ in range(3)], (PERIODS + 1) * WINDOW
    together = SuccessiveTrackers(trackers, [i * size for i in range(3)])
    for i in range(3):
        columns = record(0.01, 0.003, seed=i)
        together.process(Block(np.array(list(columns.values())), tuple(columns), RATE_HZ, start=i * size))
    found = together.found()["judged"]["levels"]
    assert found["periods"] == 3 * (PERIODS - 1)
    each = [10 ** (expected_db(0.003 * u**3, 2 * u + 0.003 * u**3, ODD) / 10) for u in map(period, range(3))]
    assert found["odd"]["db"] == pytest.approx(10 * np.log10(np.mean(each)), abs=0.3)


def test_lines_that_are_not_odd_and_lines_of_a_denser_excitation_show_no_levels() -> None:
    assert [bins.size for bins in detection_bins(Lines((2, 3, 5), 100, 1000.0))] == [0, 0]
    every = Lines.of_bins(range(3, 101), WINDOW, RATE_HZ)
    u = np.tile(multisine(every, 0.1, "schroeder"), 8)
    levels, events = tracked({"w": u, "u": u, "y": 2 * u + 0.01 * np.roll(u, 1)})
    assert levels == {"even": None, "odd": None}
    assert events == []


def test_a_run_records_prints_and_reports_them(tmp_path: Path) -> None:
    log = write_parquet(tmp_path / "log.parquet", record(0.01, 0.003))
    roles = ("--excitation", "w", "--input", "u", "--output", "y", "--accept-roles")
    done = livebode("run", log, *roles, "--rate", 1000, "--out", tmp_path / "run", "--hop", WINDOW)
    assert done.code == 0, done.err
    assert "distortion at the detection lines, relative to the output at a line: even -44." in " ".join(
        done.err.split()
    )
    levels = json.loads((tmp_path / "run" / "run.json").read_text())["found"]["judged"]["levels"]
    assert levels["even"]["db"] == pytest.approx(-44.3, abs=0.3)
    assert levels["odd"]["low_db"] < levels["odd"]["db"] < levels["odd"]["high_db"]
    assert levels["frequency_hz"] == [*(EVEN * 2.0), *(ODD * 2.0)]
    report = run_report(tmp_path / "run", made=datetime.now(UTC))
    (section,) = (section for section in report.sections if section.title == "Distortion")
    table = section.parts[1]
    assert isinstance(table, PrintedTable)
    level = levels["even"]
    assert table.rows[0][:3] == ("even", f"{level['db']:.1f}", f"{level['low_db']:.1f} … {level['high_db']:.1f}")
