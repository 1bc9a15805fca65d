"""The average of a recording is that of all its periods, shows a drift, and is what is drawn, printed and fitted."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.linalg import expm
from scipy.stats import binom

import livebode
from livebode.core import Block, Channel, Lines, Responses
from livebode.estimation import Settings, Tracker
from livebode.fitting import DriftTest
from livebode.fitting.time_course import FALSE_ALARM
from livebode.pictures import save_pictures
from tests.support.command import livebode as command

RATE_HZ, WINDOW = 2000.0, 1000
LINES = Lines.parse("4:184:6", RATE_HZ, WINDOW)
MOTOR, LOAD, STIFFNESS, DAMPING = 0.0012, 0.0025, 180.0, 0.014


def motor_speed(stiffness: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The motor's speed of two masses on a shaft for a torque that is held over a sample: A, B, and poles."""
    a = np.array(
        [[-DAMPING / MOTOR - 0.5, DAMPING / MOTOR, -stiffness / MOTOR],
         [DAMPING / LOAD, -DAMPING / LOAD, stiffness / LOAD], [1.0, -1.0, 0.0]]
    )  # fmt: skip
    block = np.zeros((4, 4))
    block[:3, :3], block[0, 3] = a, 1 / MOTOR
    stepped = expm(block / RATE_HZ)
    return stepped[:3, :3], stepped[:3, 3], np.linalg.eigvals(stepped[:3, :3])


def response(stiffness: float) -> np.ndarray:
    a, b, _ = motor_speed(stiffness)
    z = np.exp(2j * np.pi * LINES.frequency_hz / RATE_HZ)
    return np.array([np.linalg.solve(at * np.eye(3) - a, b)[0] for at in z])


@cache
def excitation() -> np.ndarray:
    phases = -np.pi * np.arange(len(LINES)) ** 2 / len(LINES)
    n = np.arange(WINDOW)
    lines = np.array([np.cos(2 * np.pi * k * n / WINDOW + p) for k, p in zip(LINES.bins, phases)])
    return np.asarray(0.02 * lines.sum(axis=0))


def recorded(seed: int, periods: int, *, softer: float = 0.0, noise: float = 0.02) -> np.ndarray:
    """Excitation, torque and speed of the axis in closed loop, (3, samples); it loses stiffness evenly by `softer`."""
    rng = np.random.default_rng(seed)
    run_in, state, integral = 3, np.zeros(3), 0.0
    rows: list[tuple[float, float, float]] = []
    stretches = 1 if not softer else periods
    w = np.tile(excitation(), periods + run_in)
    noises = noise * rng.standard_normal(w.size)
    for stretch in range(stretches):
        a, b, _ = motor_speed(STIFFNESS * (1 - softer * stretch / max(1, stretches - 1)))
        count = WINDOW * (periods // stretches + (run_in if stretch == 0 else 0))
        for _ in range(count):
            n = len(rows)
            y = state[0] + noises[n]
            integral -= y / RATE_HZ
            u = -0.02 * y + 0.1 * integral + w[n]
            rows.append((w[n], u, y))
            state = a @ state + b * u
    return np.array(rows)[WINDOW * run_in :].T


def block(samples: np.ndarray) -> Block:
    return Block(samples, tuple(map(Channel, "wuy")), RATE_HZ)


def averaged(samples: np.ndarray) -> Responses:
    settings = Settings(lines=LINES, output="y", input="u", excitation="w", average=True, forgetting=1.0, hop=250)
    return Tracker(settings).process(block(samples))


@cache
def healthy(seed: int) -> Responses:
    """Averages of twelve periods of an axis that does not change."""
    return averaged(recorded(seed, 12))


def run(folder: Path, samples: np.ndarray, *options: object) -> tuple[livebode.Run, str, str]:
    pq.write_table(pa.table(dict(zip("wuy", samples))), folder / "log.parquet")
    roles = ("--excitation", "w", "--input", "u", "--output", "y", "--rate", RATE_HZ, "--window", WINDOW)
    done = command("run", folder / "log.parquet", *roles, "--average", *options, "--out", folder / "run")
    assert done.code == 0, done.err
    return livebode.Run(folder / "run"), done.out, done.err


def test_all_periods_of_a_recording_are_averaged(tmp_path: Path) -> None:
    """The value is S_wy/S_wu over every period, by NumPy; the extent is the whole recording."""
    samples = recorded(1, 24)
    found, _, _ = run(tmp_path, samples)
    w, u, y = np.fft.rfft(samples.reshape(3, 24, WINDOW))[..., list(LINES.bins)]
    expected = (y * w.conj()).sum(axis=0) / (u * w.conj()).sum(axis=0)
    average = found.average
    assert np.allclose(average.value, expected, rtol=1e-9)
    assert (average.first, average.sample) == (0, 24 * WINDOW - 1)


def test_what_is_drawn_and_printed_is_that_average(tmp_path: Path) -> None:
    """The picture has the bytes of one that is drawn from `Run.average` alone."""
    found, out, _ = run(tmp_path, recorded(2, 24, softer=0.02))
    assert "plant G: average over 12 s" in out
    (tmp_path / "again").mkdir()
    title = f"{(tmp_path / 'log.parquet').name}: y"
    save_pictures(Responses.of(found.average), tmp_path / "again", title=title, names=("u", "y"), mean=found.average)
    assert (tmp_path / "again" / "bode.svg").read_bytes() == (tmp_path / "run" / "bode.svg").read_bytes()


def test_the_bounds_of_an_average_cover() -> None:
    """Of 95 % bounds at 31 lines of 60 recordings, as many cover as in 99.9 % of such studies.

    The lines of a recording share nothing: the noise of the sensor is white, and its spectra are independent.
    """
    truth, inside, count = response(STIFFNESS), 0, 0
    for seed in range(60):
        average = healthy(seed)[-1]
        inside += int(np.count_nonzero(np.abs(average.value - truth) <= _radius(average)))
        count += len(LINES)
    assert binom.ppf(0.0005, count, 0.95) <= inside <= binom.ppf(0.9995, count, 0.95)


def _radius(average: livebode.Response) -> np.ndarray:
    """Of the circle that contains the true value with 95 %: |e|²/σ² is F(2, 2·dof)."""
    return np.asarray(average.sigma * np.sqrt(average.dof * (0.05 ** (-1 / average.dof) - 1)))


def test_windows_of_an_average_are_those_without_it() -> None:
    """The drift test of averages is that of the windows that they contain."""
    samples = recorded(3, 20, softer=0.03, noise=0.002)
    single = Tracker(Settings(lines=LINES, output="y", input="u", excitation="w", hop=250))
    own, expected = DriftTest(LINES), DriftTest(LINES)
    expected.add(single.process(block(samples)))
    own.add(averaged(samples))
    # With a resonance that moves, the input changes, whose power is taken as constant.
    away = np.abs(own.result().change - expected.result().change)
    assert np.all(away < 0.05 * np.abs(expected.result().change) + 0.01 * expected.result().sigma)


def test_averages_without_drift_are_rarely_reported() -> None:
    """At 0.5 %, of 60 recordings more than 3 are reported with a probability of 0.03 %."""
    alarms = 0
    for seed in range(60):
        test = DriftTest(LINES)
        test.add(healthy(seed))
        alarms += test.result().significant
    assert FALSE_ALARM == 0.005
    assert alarms <= 3


def test_a_drift_is_not_hidden_by_the_average(tmp_path: Path) -> None:
    """Two percent of the stiffness within the recording: a sentence, in run.json, and the bound of the average."""
    found, _, err = run(tmp_path, recorded(5, 24, softer=0.02))
    drift = found.summary["drift"]
    during = np.array([response(STIFFNESS * (1 - 0.02 * share)) for share in np.linspace(0, 1, 40)])
    change = np.abs(during[-1] - during[0]) / np.abs(during.mean(axis=0))
    most = max(drift["lines"], key=lambda line: line["percent"])
    true = dict(zip(LINES.frequency_hz, 100 * change))[most["frequency_hz"]]
    assert drift["found"]
    assert abs(most["percent"] - true) < 4 * most["percent_sigma"] + 0.1 * true
    words = " ".join(err.split())
    assert f"the response drifts during the recording, most at {most['frequency_hz']:g} Hz" in words
    assert "run a part of the recording (--from, --to)" in words
    average = found.average
    assert np.mean(np.abs(during - average.value) < 2 * average.sigma) >= 0.95
