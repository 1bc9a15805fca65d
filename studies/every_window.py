"""What is the same in every window: a recording with a fault that repeats gives a right response, or a refusal.

Run `python -m studies.every_window --cases 200 --seed 1000` (`--kinds creep,wrap`, `--list` prints each case). A case
is two masses on a torque with a multisine, measured as a position or a velocity; rate, window, periods, lines, noise
and quantisation are drawn, and the fault of its kind is added. It is recorded in a CSV file and run as `livebode run`
does by default, with and without `--average`. The truth is the plant itself, since the samples are its periodic steady
state.

A case is *right* if at least half of its lines are valid, 90 % of these, or all but two, are within the 98 % bound of
the mean, and their median bound is at most 50 % of the response: of 16 to 29 lines with a correct bound, three are
beyond it in one case of 250 to 50; a bound of 50 % says nothing. It is *refused* if the run stops with an
error that has a remedy, or at most half of the lines are valid and an event gives the reason; else it is *wrong*, in
some cases only because the bound is too *wide*. `width` is the median bound, relative to that of the same recording
without its fault.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from livebode import Lines, Run, multisine
from livebode.configuration import Axis
from livebode.core import LivebodeError, SignalError
from livebode.runtime import Destination, run
from studies.common import Complex, Floats

WITHIN, BEYOND, VALID, WIDE = 0.9, 2, 0.5, 0.5
CIRCLE_98 = float(np.sqrt(-np.log(0.02)))  # of a complex normal error, in sigma


@dataclass(frozen=True)
class Recording:
    """Samples of a case before or after its fault.

    Attributes
    ----------
    u, y
        Input, which is exact, and output with its noise.
    window
        Samples of a period.
    rate_hz
        Samples per second.
    swing
        Standard deviation of the excited part of y.
    noise
        Standard deviation of the noise in y, relative to the swing.
    unit
        Of y; empty for none.
    """

    u: Floats
    y: Floats
    window: int
    rate_hz: float
    swing: float
    noise: float
    unit: str = ""

    @property
    def periods(self) -> Floats:
        """Time of each sample, in periods."""
        return np.arange(self.y.size) / self.window


Kind = Callable[[Recording, np.random.Generator], Recording]


def healthy(recording: Recording, _: np.random.Generator) -> Recording:
    """A recording without a fault."""
    return recording


def creep(recording: Recording, rng: np.random.Generator) -> Recording:
    """A ramp of 0.01 to 100 swings in a period."""
    return _moved(recording, _size(rng, 0.01, 100) * recording.periods)


def bent_creep(recording: Recording, rng: np.random.Generator) -> Recording:
    """A creep whose speed changes, at a constant rate or exponentially."""
    t = recording.periods
    speed = _size(rng, 0.01, 30)
    if rng.random() < 0.5:
        return _moved(recording, speed * (t + rng.uniform(-1, 1) * t**2 / t[-1]))
    settling = rng.uniform(0.15, 1) * t[-1]
    return _moved(recording, speed * settling * np.exp(-t / settling))


def random_walk(recording: Recording, rng: np.random.Generator) -> Recording:
    """A random walk of 0.01 to 3 swings in a period."""
    steps = rng.standard_normal(recording.y.size) / np.sqrt(recording.window)
    return _moved(recording, _size(rng, 0.01, 3) * np.cumsum(steps))


def wander(recording: Recording, rng: np.random.Generator) -> Recording:
    """A smooth wander: three sines, each over 2 to 20 periods."""
    t = recording.periods
    over, phase = rng.uniform(2, 20, 3), rng.uniform(0, 2 * np.pi, 3)
    return _moved(recording, _size(rng, 0.03, 30) * np.sin(np.outer(2 * np.pi * t, 1 / over) + phase).sum(axis=1))


def repeated_spike(recording: Recording, rng: np.random.Generator) -> Recording:
    """One to three spikes of one to three samples at the same places of every period, of 0.01 to 100 swings."""
    period = np.zeros(recording.window)
    for place in rng.choice(recording.window, rng.integers(1, 4), replace=False):
        size = _size(rng, 0.01, 100)
        period[(place + np.arange(rng.integers(1, 4))) % recording.window] += size * rng.uniform(0.3, 1)
    return _moved(recording, np.tile(period, recording.y.size // recording.window))


def turning_spike(recording: Recording, rng: np.random.Generator) -> Recording:
    """A spike of 0.01 to 100 swings at every turn, of 0.3 to 3 periods."""
    turn = rng.uniform(0.3, 3) * recording.window
    places = np.arange(rng.uniform(0, turn), recording.y.size, turn).astype(np.int64)
    spikes = np.zeros(recording.y.size)
    spikes[places] = _size(rng, 0.01, 100)
    return _moved(recording, spikes)


def saturation(recording: Recording, rng: np.random.Generator) -> Recording:
    """An output that is cut off at 30 to 95 % of its largest value, on one side or on both."""
    limit = rng.uniform(0.3, 0.95) * float(np.abs(recording.y).max())
    low = -limit if rng.random() < 0.5 else -np.inf
    return replace(recording, y=np.clip(recording.y, low, limit))


def dead_band(recording: Recording, rng: np.random.Generator) -> Recording:
    """Values within 0.02 to 0.7 swings that are reported as zero, or by which the others are smaller."""
    width = abs(_size(rng, 0.02, 0.7)) * recording.swing
    outside = np.abs(recording.y) > width
    less = width * np.sign(recording.y) if rng.random() < 0.5 else 0.0
    return replace(recording, y=np.where(outside, recording.y - less, 0.0))


TURNS = {"rad": 2 * np.pi, "deg": 360.0, "rev": 1.0}
UNNAMED_TURNS = (2 * np.pi, 360.0, 1.0, *(float(1 << bits) for bits in (8, 10, 12, 13, 16, 17, 20, 24, 32)))


def wrap(recording: Recording, rng: np.random.Generator) -> Recording:
    """An angle that turns, or swings around the end of its range, and wraps at a turn."""
    unit = str(rng.choice(["", *TURNS]))
    turns_possible = [TURNS[unit]] if unit else [t for t in UNNAMED_TURNS if t < 256 or t * recording.noise > 10]
    turn = float(rng.choice(turns_possible))
    counts = turn >= 256 and turn != 360
    # In turns: the excitation moves the angle by up to a tenth of one, and the axis turns by up to 2 in a period.
    share = abs(_size(rng, 1e-3, 0.03))
    if counts:  # the noise is half a count or more, else quantisation is the same in every period
        share = max(share, 0.5 / (turn * recording.noise))
    scale = share / recording.swing
    turns = recording.y * scale + _size(rng, 0.02, 2) * rng.integers(2) * recording.periods
    signed = rng.random() < 0.5
    turns += 0.5 if signed else 0.0
    y = (turns + 0.5) % 1 - 0.5 if signed else turns % 1
    y = np.floor(y * turn) if counts else y * turn
    return replace(recording, y=y, u=recording.u * scale * turn, swing=share * turn, unit=unit)


KINDS: Mapping[str, Kind] = {
    "healthy": healthy,
    "creep": creep,
    "bent creep": bent_creep,
    "random walk": random_walk,
    "wander": wander,
    "wrap": wrap,
    "repeated spike": repeated_spike,
    "turning spike": turning_spike,
    "saturation": saturation,
    "dead band": dead_band,
}
"""Faults by name; those of `wrap` change the unit of y, and of u so that the response remains that of the plant."""


def _size(rng: np.random.Generator, low: float, high: float) -> float:
    """A size between these, with either sign."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))) * rng.choice([-1, 1]))


def _moved(recording: Recording, swings: Floats) -> Recording:
    return replace(recording, y=recording.y + recording.swing * swings)


@dataclass(frozen=True)
class Case:
    """A recording without and with its fault, and the truth at its lines."""

    kind: str
    lines: Lines
    truth: Complex
    plain: Recording
    faulty: Recording
    average: bool


def draw(kind: str, rng: np.random.Generator) -> Case:
    """A case of this kind."""
    window = int(rng.choice([200, 250, 400, 500, 1000, 1024]))
    rate_hz = float(rng.choice([1000.0, 2000.0, 4000.0]))
    step, first = int(rng.choice([1, 1, 2])), int(rng.integers(1, 4))
    count = int(rng.integers(16, 49))
    bins = tuple(range(first, min(first + count * step, int(0.4 * window)), step))
    lines = Lines(bins, window, rate_hz)
    truth = _plant(lines, rng, position=rng.random() < 0.7)
    period = multisine(lines, 1.0, rng.uniform(0, 2 * np.pi, len(lines)))
    spectrum = np.fft.rfft(period)
    answer = np.zeros_like(spectrum)
    answer[list(bins)] = spectrum[list(bins)] * truth
    y = np.fft.irfft(answer, window)
    swing, periods = float(y.std()), int(rng.integers(10, 33))
    level = float(np.exp(rng.uniform(np.log(1e-4), np.log(3e-2))))
    y = np.tile(y, periods) + swing * level * rng.standard_normal(window * periods)
    plain = Recording(np.tile(period, periods), y, window, rate_hz, swing, level)
    faulty = KINDS[kind](plain, rng)
    quantum = level * rng.uniform(0.1, 2)  # that of a wider one is the same in every period
    plain, faulty = (_recorded(one, quantum * one.swing) for one in (plain, faulty))
    return Case(kind, lines, truth, plain, faulty, average=rng.random() < 0.5)


def _recorded(recording: Recording, quantum: float) -> Recording:
    """With the quantisation of the output; counts have theirs already."""
    y = recording.y
    return recording if np.array_equal(y, np.round(y)) else replace(recording, y=np.round(y / quantum) * quantum)


def _plant(lines: Lines, rng: np.random.Generator, *, position: bool) -> Complex:
    """Two masses: a rigid body with an antiresonance and a resonance within the lines, and friction."""
    f = lines.frequency_hz
    s, high = 2j * np.pi * f, 2 * np.pi * f[-1]
    zero = high * rng.uniform(0.2, 0.6)
    pole, damping = zero * rng.uniform(1.1, 1.5), rng.uniform(0.02, 0.1)
    g = (s**2 / zero**2 + 2 * damping * s / zero + 1) / (s**2 / pole**2 + 2 * damping * s / pole + 1)
    g = g / (s + high * rng.uniform(0.01, 0.1)) * high
    return np.asarray(g / s * high if position else g) / lines.z


@dataclass(frozen=True)
class Verdict:
    """Result of a case: "right", "refused" or "wrong", and the facts behind it."""

    word: str
    why: str
    valid: float = float("nan")
    within: float = float("nan")
    width: float = float("nan")
    wide: bool = False


def judge(case: Case, folder: Path) -> Verdict:
    """Record the case, run it, and compare with the truth."""
    try:
        events, error, bound, valid = _measure(case, case.faulty, folder)
    except LivebodeError as refusal:
        return Verdict("refused" if refusal.remedy else "wrong", f"{refusal.code}: {refusal}")
    kinds = ", ".join(dict.fromkeys(events))
    share = float(valid.mean())
    if share <= VALID:
        return Verdict("refused" if events else "wrong", f"{kinds}; few lines are valid", share)
    _, _, usual, plainly = _measure(case, case.plain, folder)
    both = valid & plainly
    width = float(np.median(bound[both]) / np.median(usual[both])) if both.any() else float("nan")
    within = float(np.mean(error[valid] <= bound[valid]))
    wide = float(np.median(bound[valid] / np.abs(case.truth[valid])))
    beyond = np.count_nonzero(error[valid] > bound[valid])
    covers = beyond <= max(BEYOND, (1 - WITHIN) * np.count_nonzero(valid))
    word = "right" if covers and wide <= WIDE else "wrong"
    return Verdict(word, f"{kinds}; median bound {wide:.2g}", share, within, width, covers and wide > WIDE)


def _measure(case: Case, recording: Recording, folder: Path) -> tuple[list[str], Floats, Floats, np.ndarray]:
    """Kinds of events, error and 98 % bound of the mean at each line, and which are valid."""
    log = folder / "case.csv"
    unit = f" [{recording.unit}]" if recording.unit else ""
    t = np.arange(recording.u.size) / recording.rate_hz
    table = np.column_stack([t, recording.u, recording.y])
    np.savetxt(log, table, delimiter=",", header=f"t [s],u,y{unit}", comments="", fmt=["%.6f", "%.9g", "%.17g"])
    sections: dict[str, dict[str, Any]] = {
        "source": {"log": log},
        "signals": {"input": "u", "output": "y"},
        "tracking": {"estimator": "direct"} | ({"average": True} if case.average else {}),
    }
    done = run(Axis.of(sections, "a case"), Destination(folder / "run", lambda *_: None, force=True))
    found = Run(done.directory)
    try:
        mean = found.average
    except SignalError:
        nothing = np.zeros(len(case.lines))
        return [event.kind for event in found.events], nothing, nothing, nothing > 0
    scale = {"deg": np.pi / 180, "rev": 2 * np.pi}.get(recording.unit, 1.0)
    at = np.searchsorted(mean.frequency_hz, case.lines.frequency_hz - case.lines.resolution_hz / 4)
    at = np.minimum(at, len(mean.frequency_hz) - 1)
    known = np.abs(mean.frequency_hz[at] - case.lines.frequency_hz) < case.lines.resolution_hz / 4
    error, valid = np.abs(mean.value[at] / scale - case.truth), mean.valid[at] & known  # a line not found is not valid
    return [event.kind for event in found.events], error, mean.bound(CIRCLE_98)[at] / scale, valid


def measure(kinds: Sequence[str], cases: int, seed: int, shown: bool = False) -> dict[str, list[Verdict]]:
    """Verdicts on so many cases, which are of each kind in turn; case n has the seed `seed` + n."""
    found: dict[str, list[Verdict]] = {kind: [] for kind in kinds}
    with tempfile.TemporaryDirectory() as folder:
        for number in range(cases):
            kind = kinds[number % len(kinds)]
            verdict = judge(draw(kind, np.random.default_rng(seed + number)), Path(folder))
            found[kind].append(verdict)
            if shown:
                print(f"{seed + number} {kind}: {verdict}", flush=True)
    return found


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cases", type=int, default=200, help="[default: 200]")
    parser.add_argument("--seed", type=int, default=1000, help="[default: 1000]")
    parser.add_argument("--kinds", default=",".join(KINDS), help="[default: all]")
    parser.add_argument("--list", action="store_true", help="print each case")
    given = parser.parse_args(arguments)
    found = measure(given.kinds.split(","), given.cases, given.seed, given.list)
    print("| kind | cases | right | refused | wrong | of these wide | within the 98 % bound | width |")
    print("|---|---|---|---|---|---|---|---|")
    for kind, verdicts in [*found.items(), ("all", [one for some in found.values() for one in some])]:
        counts = [sum(verdict.word == word for verdict in verdicts) for word in ("right", "refused", "wrong")]
        wide = sum(verdict.wide for verdict in verdicts)
        within, width = (np.array([getattr(one, name) for one in verdicts]) for name in ("within", "width"))
        judged = np.isfinite(within)
        shown = f"{within[judged].mean():.1%} | {np.median(width[judged]):.2f}" if judged.any() else "– | –"
        print(f"| {kind} | {len(verdicts)} | {counts[0]} | {counts[1]} | {counts[2]} | {wide} | {shown} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
