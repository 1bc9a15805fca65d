"""Which lines a live run marks invalid for hum of the mains in a silence before the excitation, and which it should.

Run `python -m studies.hum` (`--runs 40`). The axis is that of `studies.loop_words`: two masses, an encoder of few
counts, cogging, friction, a delay. The tones act on it as torque, or are picked up by the sensor of the current. Each
run is compared with the same one without tones: a line with hum is wrong if the mean of its response differs by more
than 2σ of that mean, which contains what the scatter of the windows shows.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass

import numpy as np

from livebode import Block, Lines, Settings, Tracker, multisine
from studies.common import Complex, Floats
from studies.loop_words import Drive, Machine, record

SILENT_S, EXCITED_S = 3, 5
LINES_HZ = (20, 35, 45, 50, 60, 70, 85, 100, 120, 135, 150, 180, 215)
RESOLUTION_HZ = 5
AXIS = Machine(
    counts_per_turn=1 << 16, cogging_n_m=0.05, friction_n_m=0.02, load_noise_n_m=0.02, torque_noise_n_m=0.003
)
LEVELS_N_M = 0.02, 0.2


@dataclass(frozen=True)
class Case:
    """Tones near a multiple of `near_hz`, in runs of which each has other ones."""

    name: str
    near_hz: float
    off_hz: tuple[float, float]
    harmonics: int = 1
    wander: float = 0.0
    is_hum: bool = True


CASES = (
    Case("no tone", 50.0, (0, 0), harmonics=0),
    Case("50 Hz", 50.0, (0, 0.1), harmonics=4),
    Case("60 Hz", 60.0, (0, 0.1), harmonics=3),
    Case("50 Hz, amplitude ± 20 %", 50.0, (0, 0.1), harmonics=4, wander=0.2),
    Case("60 Hz, amplitude ± 20 %", 60.0, (0, 0.1), harmonics=3, wander=0.2),
    Case("rotating machine near 50 Hz", 50.0, (0.6, 1.5), is_hum=False),
)


@dataclass
class Counted:
    """Of all runs: lines with hum, those marked, those that are wrong, wrong and valid ones; marked without hum."""

    tones: int = 0
    marked: int = 0
    wrong: int = 0
    wrong_valid: int = 0
    needless: int = 0


def tones(case: Case, rate_hz: float, ticks: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Samples of one run's tones, and their frequencies."""
    off_hz = rng.choice([-1, 1]) * rng.uniform(*case.off_hz)
    orders, t = np.arange(1, case.harmonics + 1), np.arange(ticks) / rate_hz
    hz = orders * (case.near_hz + off_hz)
    level = np.exp(rng.uniform(*np.log(LEVELS_N_M), orders.size))
    slow = 2 * np.pi * rng.uniform(0.1, 1.0, orders.size)
    wander = 1 + case.wander * np.sin(np.outer(t, slow) + rng.uniform(0, 2 * np.pi, orders.size))
    return np.sum(level * wander * np.cos(np.outer(t, 2 * np.pi * hz) + rng.uniform(0, 6, orders.size)), axis=1), hz


def measure(case: Case, rate_hz: float, runs: int, seed: int) -> Counted:
    """Counts over so many runs at this rate."""
    rng, window = np.random.default_rng(seed), round(rate_hz / RESOLUTION_HZ)
    lines = Lines.of_bins([hz // RESOLUTION_HZ for hz in LINES_HZ], window, rate_hz)
    period = 0.25 * len(lines) * multisine(lines, seed=seed)
    w = np.concatenate([np.zeros(SILENT_S * round(rate_hz)), np.tile(period, EXCITED_S * RESOLUTION_HZ)])
    added, hz = zip(*(tones(case, rate_hz, w.size, rng) for _ in range(runs)))
    torque, picked_up = (
        np.array(added).T * (np.arange(runs) % 2),
        np.array(added) * ((np.arange(runs) + 1) % 2)[:, None],
    )
    drive = Drive(rate_hz=rate_hz, position_gain=20.0, delay_ticks=1)
    clean, humming = (record(drive, AXIS, w, 1, runs, seed, settling=0, load=load) for load in (None, torque))
    counted = Counted()
    for run in range(runs):
        current = humming[1][run] + picked_up[run, : humming[0].size]
        before, _ = mean(lines, clean[1][run], clean[2][run])
        after, sigma = mean(lines, current, humming[2][run])
        marked = marked_lines(lines, np.array([humming[0], current, humming[2][run]]))
        near = np.abs(lines.frequency_hz - hz[run][:, np.newaxis]) <= RESOLUTION_HZ / 2
        tone = near.any(axis=0) & case.is_hum
        wrong = tone & (np.abs(after - before) > 2 * sigma)
        counted.tones += np.count_nonzero(tone)
        counted.marked += np.count_nonzero(tone & marked)
        counted.wrong += np.count_nonzero(wrong)
        counted.wrong_valid += np.count_nonzero(wrong & ~marked)
        counted.needless += np.count_nonzero(marked & ~tone)
    return counted


def mean(lines: Lines, u: Floats, y: Floats) -> tuple[Complex, Floats]:
    """Ratio of the averages over the periods after the first second of excitation, and its sigma."""
    window, bins = lines.window, list(lines.bins)
    first = round((SILENT_S + 1) * lines.rate_hz)
    periods = (u.size - first) // window
    spectra = [np.fft.rfft(x[first : first + periods * window].reshape(periods, window))[:, bins] for x in (u, y)]
    found = spectra[1].mean(axis=0) / spectra[0].mean(axis=0)
    errors = (spectra[1] - found * spectra[0]) / spectra[0].mean(axis=0)
    return found, np.sqrt(np.sum(np.abs(errors) ** 2, axis=0) / (periods - 1) / periods)


def marked_lines(lines: Lines, signals: Floats) -> np.ndarray:
    """Which lines a live run marks invalid for hum."""
    tracker = Tracker(Settings(lines=lines, output="y", input="u", excitation="w", hop=lines.window // 2))
    tracker.process(Block(signals, ("w", "u", "y"), lines.rate_hz))
    return np.isin(lines.frequency_hz, tracker.found()["judged"]["invalid_lines_hz"].get("hum", []))


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--runs", type=int, default=40, help="of each case [default: 40]")
    runs = parser.parse_args(arguments).runs
    print("| rate, Hz | case | lines with hum | of them marked | of them wrong | of these valid | marked without hum |")
    print("|---|---|---|---|---|---|---|")
    for rate_hz in (2000.0, 8000.0):
        for number, case in enumerate(CASES):
            c = measure(case, rate_hz, runs, seed=number)
            print(
                f"| {rate_hz:g} | {case.name} | {c.tones} | {c.marked} | {c.wrong} | {c.wrong_valid} | {c.needless} |",
                flush=True,
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
