"""Bounds of response matrices in closed loop, compared with the truth: `python -m studies.mimo [runs]`.

Each run is a recording of the simulated gantry in closed loop, with correlated noise on the speeds, which the loop
feeds back into the torques, and orthogonal multisines. What counts is how often the 63 and the 98 % bound of each entry
cover the truth, and the variance in comparison with the Cramér–Rao bound. That bound has the noise of the speeds alone.
The windows also contain what begins and ends in them: a torque that drifts and a mode that rings do not have the
response of the line there. `leakage` is this share in closed form.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebode.core import PID, Block, Lines, MatrixLoop, MatrixResponses
from livebode.excitation import MatrixExcitation
from livebode.simulation import Gantry, GantryLoop
from livebode.simulation.gantry import CHANNELS
from livebode_matrix import MatrixSettings, MatrixTracker
from studies.result import Verdict

RUNS, AT_ONCE = 4000, 50
LOOP = GantryLoop(gantry=Gantry(motor_viscous_n_m_s=0.05), rate_hz=1000.0)
LINES = Lines.parse("10:80:10", rate_hz=1000, window=400)
AMPLITUDE_N_M, NOISE_RAD_PER_S, POLE = 0.3, 0.05, 0.8
MIXING = (1.0, 0.0), (0.6, 0.8)  # of the noise of both motors
MEMORY = 6
GRID = 1 << 16  # frequencies of the closed form
PERIODS = {"dwell": 2, "settle": 1}
EXCITATION = MatrixExcitation.orthogonal(LINES, 2, AMPLITUDE_N_M, **PERIODS)
CONTROLLER = PID(gain=LOOP.gain_n_m_s, integral_time_s=LOOP.integral_time_s, rate_hz=LOOP.rate_hz)
SIGNALS = {"output": ("velocity1", "velocity2"), "input": ("u1", "u2"), "excitation": ("w1", "w2")}

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Outcome:
    """What one estimator found: shapes (runs, lines, outputs, inputs)."""

    name: str
    within: tuple[Floats, Floats]  # shares of the runs within the 63 and the 98 % bound, (outputs, inputs)
    variance: Floats  # over the Cramér–Rao bound, (lines, outputs, inputs)
    expected: Floats  # the same in closed form, (lines, outputs)
    runs: int


def settings(estimator: str = "joint", *, average: bool = True) -> MatrixSettings:
    loop = MatrixLoop(feedback=[[CONTROLLER, None], [None, CONTROLLER]])
    signals = SIGNALS if estimator != "direct" else SIGNALS | {"excitation": ()}
    options = {"loop": loop, "memory": MEMORY, "average": average, "hop": LINES.window} | PERIODS
    return MatrixSettings(lines=LINES, estimator=estimator, **signals, **options)  # type: ignore[arg-type]


def recordings(runs: int, rng: np.random.Generator) -> Floats:
    """Signals of as many recordings, shape (channels, samples, runs): noise of two poles, alike on both motors."""
    w = np.tile(EXCITATION.samples, MEMORY)
    white = rng.standard_normal((3, w.shape[1], runs))
    noise = np.empty_like(white)
    noise[:, 0] = white[:, 0]
    for n in range(1, w.shape[1]):
        noise[:, n] = POLE * noise[:, n - 1] + np.sqrt(1 - POLE**2) * white[:, n]
    noise[:2] = np.einsum("ij,jnr->inr", MIXING, noise[:2])
    inputs = np.zeros((7, w.shape[1], runs))
    inputs[:2], inputs[4:] = w[:, :, np.newaxis], NOISE_RAD_PER_S * noise
    return LOOP.signals(inputs)


def last_matrices(signals: Floats, chosen: MatrixSettings) -> MatrixResponses:
    """The last matrix of each recording."""
    blocks = (Block(np.ascontiguousarray(one), CHANNELS, LOOP.rate_hz) for one in np.moveaxis(signals, 2, 0))
    return MatrixResponses.join([MatrixTracker(chosen).process(block)[-1:] for block in blocks])


def cramer_rao(truth: Complex) -> Floats:
    """Least variance of each entry from all repetitions, shape (lines, outputs, inputs)."""
    f, window = LINES.frequency_hz, LINES.window
    inner = np.eye(2) + CONTROLLER.response(f)[:, None, None] * truth
    inputs = np.linalg.solve(inner, EXCITATION.spectra.transpose(2, 1, 0)) * window / 2
    gram = np.linalg.inv(inputs @ np.swapaxes(inputs, 1, 2).conj())
    noise = window * NOISE_RAD_PER_S**2 * _coloured(f)
    return np.asarray(noise[:, None, None] * np.einsum("kii->ki", gram).real[:, None, :] / MEMORY * np.ones((1, 2, 1)))


def leakage(truth: Complex, indirect: bool = False, window: int = LINES.window) -> Floats:
    """Power of y − G·u in a window over that of the noise in the speeds, shape (lines, outputs).

    Σ_τ (N − |τ|)·r(τ)·exp(−jωτ), where r is the covariance of (1 + G·C)·S·noise. The closed loop's S = (1 + P·C)⁻¹ is
    that of all frequencies and G that of the line; so is C of the indirect estimate.
    """
    f, rate_hz = LINES.frequency_hz, LOOP.rate_hz
    grid_hz = np.fft.fftfreq(GRID, 1 / rate_hz)[1:]  # a constant is at no line
    z = np.exp(2j * np.pi * grid_hz / rate_hz)
    controller = np.where(grid_hz < 0, np.conj(CONTROLLER.response(-grid_hz)), CONTROLLER.response(grid_hz))
    plant = LOOP.gantry.response(grid_hz, rate_hz)[:, :2]
    sensitivity = np.linalg.inv(np.eye(2) + controller[:, None, None] * plant)
    power = (1 - POLE**2) / np.abs(1 - POLE / z) ** 2
    mixed = np.sqrt(power)[:, None, None] * np.array(MIXING)
    lag = np.arange(1 - window, window)
    found = np.empty((len(f), 2))
    for k, own in enumerate(truth):
        back = CONTROLLER.response(f[k : k + 1]) if indirect else controller
        seen = (np.eye(2) + back[:, None, None] * own) @ sensitivity @ mixed
        covariance = np.fft.ifft(np.vstack([np.zeros((1, 2)), np.sum(np.abs(seen) ** 2, axis=2)]), axis=0)
        terms = (window - np.abs(lag)) * np.exp(-2j * np.pi * f[k] / rate_hz * lag)
        found[k] = (terms @ covariance[lag % GRID]).real / window
    return found / _coloured(f)[:, np.newaxis]


def _coloured(frequency_hz: Floats) -> Floats:
    """Power of the noise over that of white noise."""
    return np.asarray((1 - POLE**2) / np.abs(1 - POLE * np.exp(-2j * np.pi * frequency_hz / LOOP.rate_hz)) ** 2)


def measure(runs: int = RUNS, seed: int = 1) -> list[Outcome]:
    rng = np.random.default_rng(seed)
    truth = LOOP.gantry.response(LINES.frequency_hz, LOOP.rate_hz)[:, :2]
    kinds = {
        "joint, all repetitions": settings(),
        "joint, newest": settings(average=False),
        "indirect, all repetitions": settings("indirect"),
    }
    found: dict[str, list[MatrixResponses]] = {name: [] for name in kinds}
    for _ in range(0, runs, AT_ONCE):
        signals = recordings(AT_ONCE, rng)
        for name, chosen in kinds.items():
            found[name].append(last_matrices(signals, chosen))
    least = cramer_rao(truth)
    return [_outcome(name, MatrixResponses.join(parts), truth, least, kinds[name]) for name, parts in found.items()]


def _outcome(name: str, found: MatrixResponses, truth: Complex, least: Floats, chosen: MatrixSettings) -> Outcome:
    error = np.abs(found.value - truth)
    within = [np.mean(error <= found.bound(c), axis=(0, 1)) for c in (1.0, 2.0)]
    variance = np.mean(error**2, axis=0) / (least if chosen.average else least * MEMORY)
    expected = leakage(truth, chosen.estimator == "indirect")
    return Outcome(name, (within[0], within[1]), variance, expected, len(error))


def verdicts(outcomes: list[Outcome]) -> list[Verdict]:
    found = []
    for one in outcomes:
        for nominal, share in zip((63.2, 98.2), one.within):
            off = 100 * share - nominal
            low, high = float(off.min()), float(off.max())
            found.append(Verdict(f"{one.name}: entry that {nominal} % covers least, points off", -low, 3.0))
            found.append(Verdict(f"{one.name}: entry that {nominal} % covers most, points off", high, 3.0))
        worst = float(one.variance.mean(axis=0).max())
        found.append(Verdict(f"{one.name}: variance over Cramér–Rao, mean of the lines, worst entry", worst, 1.15))
        found.append(Verdict(f"{one.name}: the same at the worst line", float(one.variance.max()), 1.15))
        found.append(Verdict(f"{one.name}: that of the worst line in closed form", float(one.expected.max()), 1.15))
        # The power of a circular error has a standard deviation as large as its mean.
        off = np.abs(one.variance / one.expected[:, :, None] - 1).max() * np.sqrt(one.runs)
        found.append(Verdict(f"{one.name}: measured and closed form, largest difference / sigma", float(off), 4.0))
    return found


def main(words: list[str]) -> int:
    outcomes = measure(int(words[0]) if words else RUNS)
    for one in outcomes:
        print(one.name)
        for o in range(2):
            cells = [f"{100 * one.within[0][o, i]:.1f} / {100 * one.within[1][o, i]:.1f} %" for i in range(2)]
            print(f"  velocity{o + 1}: from u1 {cells[0]}, from u2 {cells[1]}")
    print(f"slowest transient: time constant {-1e3 / LOOP.rate_hz / np.log(LOOP.decay):.0f} ms")
    truth = LOOP.gantry.response(LINES.frequency_hz, LOOP.rate_hz)[:, :2]
    forms = {
        "joint": leakage(truth),
        "joint, twice the window": leakage(truth, window=2 * LINES.window),
        "indirect": leakage(truth, indirect=True),
    }
    print("variance over Cramér–Rao in closed form, the larger of both outputs, at", *LINES.frequency_hz, "Hz")
    for name, form in forms.items():
        print(f"  {name:24}", *(f"{x:.3f}" for x in form.max(axis=1)))
    for verdict in verdicts(outcomes):
        print(verdict)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
