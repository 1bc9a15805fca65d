"""Coverage of the bounds of modes from the output alone, over damping, window, rate and colour of the force.

Run `python -m studies.output_only` (`--runs 40`). The machine is a state-space model: modes of a speed beside the rigid
motion of a mass with viscous friction, both under one force, and noise of a sensor. A run has five windows. The table
has the runs with exactly one curve for each mode, the share of the windows in which a mode was found, and the share of
the errors in the bounds. A second table has windows of a mode that are taken for a harmonic or a moving tone, and
windows of a sweep of the force, through a resonance at 67 Hz, in which the tone is found.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import expm
from scipy.signal import lfilter
from threadpoolctl import threadpool_limits

from livebode import Block
from livebode.core import Parameters
from livebode_modes import ModeTracker, OutputOnlySettings, Tracks, WindowModes, lost_samples, reduced
from studies.common import Floats

WINDOWS, HOPS = 5, 20
SIGMAS = {"63 %": 0.9, "95 %": 1.96}
SEED = 1000


@dataclass(frozen=True)
class Case:
    """A machine: modes (frequency in Hz, damping), in a band; a window of 20 hops of `hop` reduced samples.

    `colour` is the pole of the low-pass of the force at the sample rate, 0 for a white one.
    """

    name: str
    modes: tuple[tuple[float, float], ...]
    rate_hz: float = 2000.0
    band_hz: tuple[float, float] = (40.0, 100.0)
    hop: int = 50
    colour: float = 0.0


@dataclass
class Result:
    """Of all runs: curves of each run, share of found windows, errors in sigma (n, 2)."""

    curves: list[int]
    found: float
    errors: Floats


SLOPES_HZ_S = 0.25, 0.5, 1.0, 3.0
DAMPINGS = 0.005, 0.01, 0.02, 0.03, 0.05, 0.07, 0.1
BELT = Case("", ((67.0, 0.02),))
CASES = (
    *(replace(BELT, name=f"damping {100 * z:g} %", modes=((67.0, z),)) for z in DAMPINGS),
    replace(BELT, name="5 %, four times the window", modes=((67.0, 0.05),), hop=200),
    replace(BELT, name="5 %, half the window", modes=((67.0, 0.05),), hop=25),
    replace(BELT, name="5 %, force with a low-pass at 30 Hz", modes=((67.0, 0.05),), colour=0.91),
    Case("5 % at 12 Hz, 500 Hz", ((12.0, 0.05),), rate_hz=500.0, band_hz=(5.0, 20.0)),
    Case("3 % at 400 Hz, 8 kHz", ((400.0, 0.03),), rate_hz=8000.0, band_hz=(200.0, 600.0)),
    replace(BELT, name="2 % at 67 and 87 Hz", modes=((67.0, 0.02), (87.0, 0.02)), band_hz=(40.0, 110.0)),
    replace(BELT, name="5 % at 67 and 87 Hz", modes=((67.0, 0.05), (87.0, 0.05)), band_hz=(40.0, 110.0)),
)


def speeds(case: Case, samples: int, runs: int) -> Floats:
    """Speed of the machine under random forces, (runs, samples)."""
    rng, settled = np.random.default_rng(SEED), round(80 * case.rate_hz / case.band_hz[0])
    size = 2 * len(case.modes) + 1
    a, b, c = np.zeros((size, size)), np.zeros(size), np.zeros(size)
    for i, (hz, damping) in enumerate(case.modes):
        omega = 2 * np.pi * hz
        a[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = [[0, 1], [-(omega**2), -2 * damping * omega]]
        b[2 * i + 1] = c[2 * i + 1] = 1.0
    a[-1, -1], b[-1], c[-1] = -case.band_hz[0] / 10, 1.0, 1.0
    both = expm(np.block([[a, b[:, np.newaxis]], [np.zeros((1, size + 1))]]) / case.rate_hz)
    step, enter = both[:-1, :-1], both[:-1, -1:]
    force = lfilter([1.0], [1.0, -case.colour], rng.standard_normal((samples + settled, runs)), axis=0)
    state, y = np.zeros((size, runs)), np.empty((samples + settled, runs))
    for k, f in enumerate(force):
        state = step @ state + enter * f
        y[k] = c @ state
    y = y[settled:]
    return np.asarray((y + 0.01 * y.std() * rng.standard_normal(y.shape)).T)


def measure(case: Case, runs: int) -> Result:
    """Curves, found windows and errors over so many runs."""
    factor = reduced(case.rate_hz, case.band_hz[1])
    of = OutputOnlySettings(("y",), case.rate_hz, case.band_hz, factor, case.hop, HOPS)
    samples = of.window + (WINDOWS - 1) * of.hop + of.lags * factor + 2 * lost_samples(factor)
    curves, found, errors = list[int](), 0, list[Floats]()
    for y in speeds(case, samples, runs):
        rows = tracked(y, of)
        curves.append(len(rows))
        for mode in rows:
            i = int(np.argmin([abs(np.nanmedian(mode["frequency"]) - hz) for hz, _ in case.modes]))
            errors.append(((mode.value[:, :2] - case.modes[i]) / mode.sigma[:, :2])[mode.ok])
            found += int(np.count_nonzero(mode.ok))
    return Result(curves, found / (runs * WINDOWS * len(case.modes)), np.concatenate(errors))


def tracked(y: Floats, of: OutputOnlySettings) -> list[Parameters]:
    """The curves of the modes."""
    tracks, rows = Tracks(of.hops), dict[str, list[Parameters]]()
    with threadpool_limits(1):
        windows = ModeTracker(of).process(Block(np.atleast_2d(y), list(of.outputs), of.rate_hz))[:WINDOWS]
    for parts in [*map(tracks.process, windows), tracks.finish()]:
        for part in parts:
            rows.setdefault(part.model, []).append(part)
    return [Parameters.join(parts) for name, parts in rows.items() if name.startswith("mode")]


def windows_of(y: Floats, of: OutputOnlySettings) -> list[WindowModes]:
    """Windows that share no samples, each of the whole recording `y` cut into parts."""
    samples = of.window + of.lags * of.factor + 2 * lost_samples(of.factor)
    parts = [y[i : i + samples] for i in range(0, y.size - samples + 1, samples)]
    with threadpool_limits(1):
        return [ModeTracker(of).process(Block(np.atleast_2d(part), list(of.outputs), of.rate_hz))[0] for part in parts]


def misnamed(damping: float, runs: int) -> tuple[int, int, int]:
    """Windows of a mode under noise: taken for a harmonic, for a moving tone, and all."""
    of = OutputOnlySettings(("y",), 250.0, (40.0, 100.0), 1)
    pole = np.exp(2 * np.pi * 67 * complex(-damping, np.sqrt(1 - damping**2)) / of.rate_hz)
    force = np.random.default_rng(SEED).standard_normal((of.window + of.lags) * runs + 2000)
    y = lfilter([1.0, -1.0], [1.0, -2 * pole.real, abs(pole) ** 2], force)[2000:]
    found = windows_of(y + 0.01 * y.std() * np.random.default_rng(SEED + 1).standard_normal(y.size), of)
    return sum(bool(w.harmonics) for w in found), sum(w.tone is not None for w in found), len(found)


def swept(slope_hz_s: float) -> tuple[int, int]:
    """Windows of a sweep from 45 to 95 Hz: with the tone found, and all."""
    of = OutputOnlySettings(("y",), 250.0, (40.0, 100.0), 1)
    t = np.arange(round(50 / slope_hz_s * of.rate_hz)) / of.rate_hz
    pole = np.exp(2 * np.pi * 67 * complex(-0.02, 1) / of.rate_hz)
    force = np.sin(2 * np.pi * (45 + slope_hz_s / 2 * t) * t)
    y = lfilter([1.0, -1.0], [1.0, -2 * pole.real, abs(pole) ** 2], force)
    found = windows_of(y + 0.05 * np.random.default_rng(SEED).standard_normal(y.size), of)
    return sum(w.tone is not None for w in found), len(found)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--runs", type=int, default=40, help="of each case [default: 40]")
    runs = parser.parse_args(arguments).runs
    covers = " | ".join(f"{name}: {level}" for name in ("frequency", "damping") for level in SIGMAS)
    print(f"| case | decay times in a window | one curve for each mode | found in | {covers} | mean errors, sigma |")
    print("|---|---|---|---|---|---|---|---|---|")
    for case in CASES:
        print(row(case, measure(case, runs)), flush=True)
    print_tones(runs)
    return 0


def print_tones(runs: int) -> None:
    """The second table."""
    print("\n| windows of | taken for a harmonic | taken for a moving tone |\n|---|---|---|")
    for damping in DAMPINGS:
        harmonics, tones, windows = misnamed(damping, 2 * runs)
        print(f"| a mode, damping {100 * damping:g} % | {harmonics} of {windows} | {tones} of {windows} |", flush=True)
    for slope_hz_s in SLOPES_HZ_S:
        found, windows = swept(slope_hz_s)
        print(f"| a sweep of {slope_hz_s:g} Hz/s | | {found} of {windows} |", flush=True)


def row(case: Case, result: Result) -> str:
    """Of the table."""
    hz, damping = case.modes[0]
    decays = 2 * np.pi * hz * damping * HOPS * case.hop * reduced(case.rate_hz, case.band_hz[1]) / case.rate_hz
    right = sum(curves == len(case.modes) for curves in result.curves)
    shares = [100 * np.mean(np.abs(result.errors[:, i]) < s) for i in range(2) for s in SIGMAS.values()]
    means = ", ".join(f"{mean:+.2f}" for mean in result.errors.mean(axis=0))
    covered = " | ".join(f"{share:.0f} %" for share in shares)
    found = f"{right} of {len(result.curves)} | {100 * result.found:.0f} %"
    return f"| {case.name} | {decays:.0f} | {found} | {covered} | {means} |"


if __name__ == "__main__":
    sys.exit(main())
