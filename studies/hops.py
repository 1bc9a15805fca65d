"""The hop of a recording: what the mean of its responses, and a fit to it, lose at a quarter of the window.

`python -m studies.hops` simulates recordings of a servo of two masses in a speed loop, and of a closed loop under
noise. Each is tracked at a hop of a twentieth of the window, of a quarter, and of a window. The tables have for each
hop the rms error of the mean over all recordings and the mean width of its 95 % bounds, both relative to those of a
twentieth, the share of the lines that the bounds cover, and the same of the fitted parameters. The last table compares
the hops on a real recording, if its folder is given: `python -m studies.hops FOLDER`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat

import livebode
from livebode.core import Block, Lines, Response
from livebode.estimation import NonPeriodicTracker, Settings, Tracker, default_hop, quarter_hop
from studies.nonperiodic import RATE_HZ as NOISE_RATE_HZ
from studies.nonperiodic import Machine, recorded
from tools.two_mass_servo import TwoMassServo, multisine

RECORDINGS, WINDOW = 120, 1000
SIGNALS = {"output": "y", "input": "u", "excitation": "w"}
PARAMETERS = ("Js", "Keff", "resonance", "antiresonance")
_LPM_WINDOW, _LPM_RECORDINGS = 1024, 100

Arrays = tuple[NDArray[np.float64], ...]


@dataclass(frozen=True)
class Case:
    """Recordings of a machine, with the truth."""

    name: str
    recordings: Callable[[], Iterator[Arrays]]
    truth: Callable[[NDArray[np.float64]], NDArray[np.complex128]]
    settings: Settings
    parameters: tuple[float, ...] = ()


def servo(periods: int) -> Case:
    """After the transient, with 49 lines."""
    machine = TwoMassServo(damping_ratio=0.018, rate_hz=2000.0)
    bins = np.arange(2, 100, 2)
    w = np.tile(0.02 * multisine(bins, WINDOW, -np.pi * np.arange(bins.size) ** 2 / bins.size), periods + 3)
    truths = machine.motor, machine.stiffness, machine.resonance_hz, machine.antiresonance_hz

    def recordings() -> Iterator[Arrays]:
        noise = 0.03 * np.random.default_rng(periods).standard_normal((w.size, RECORDINGS))
        torque, speed, _ = machine.run(w, noise)
        for u, y in zip(torque[3 * WINDOW :].T, speed[3 * WINDOW :].T):
            yield w[3 * WINDOW :], u, y

    settings = Settings(lines=Lines(tuple(bins.tolist()), WINDOW, machine.rate_hz), **SIGNALS)
    return Case(f"servo, {periods} periods", recordings, machine.response, settings, truths)


def under_noise() -> Case:
    """Local polynomials, in a closed loop."""
    machine = Machine(2)

    def recordings() -> Iterator[Arrays]:
        for seed in range(_LPM_RECORDINGS):
            yield tuple(recorded(machine, "noise", 10 * _LPM_WINDOW, seed, closed=True, noise=0.1).data)

    lines = Lines(tuple(range(20, 190, 17)), _LPM_WINDOW, NOISE_RATE_HZ)
    return Case(
        "noise, local polynomials", recordings, machine.response, Settings(lines=lines, **SIGNALS, estimator="lpm")
    )


@dataclass
class Found:
    """Errors and half-widths at one hop, of lines and of parameters, shapes (recordings, any)."""

    errors: list[NDArray[np.float64]]
    widths: list[NDArray[np.float64]]

    def row(self, reference: Found) -> tuple[float, float, float]:
        """Rms error and mean width relative to the reference, each relative to its own, and the share covered."""
        own, other = (np.sqrt(np.mean(np.square(each.errors), axis=0)) for each in (self, reference))
        width = np.mean(self.widths, axis=0) / np.mean(reference.widths, axis=0)
        covered = np.mean(np.array(self.errors) <= np.array(self.widths))
        return float(np.mean(own / other)), float(np.mean(width)), float(covered)


def mean(arrays: Arrays, settings: Settings) -> Response:
    """The mean of all responses."""
    tracker = Tracker(settings) if settings.periodic else NonPeriodicTracker(settings)
    return tracker.process(Block(np.array(arrays), ("w", "u", "y"), settings.lines.rate_hz)).mean()


def hops(window: int) -> tuple[int, ...]:
    return default_hop(window), quarter_hop(window), window


def measure(case: Case) -> None:
    """Track all recordings at each hop, and print a table."""
    window = case.settings.lines.window
    lines, parameters = ({hop: Found([], []) for hop in hops(window)} for _ in range(2))
    for arrays in case.recordings():
        for hop in hops(window):
            response = mean(arrays, replace(case.settings, hop=hop))
            lines[hop].errors.append(np.abs(response.value - case.truth(response.frequency_hz)))
            lines[hop].widths.append(response.bound())
            if case.parameters:
                fit = livebode.fit(response, "two-mass", output="velocity")
                parameters[hop].errors.append(np.array([abs(fit[n] - t) for n, t in zip(PARAMETERS, case.parameters)]))
                parameters[hop].widths.append(np.array([fit.bound(name) for name in PARAMETERS]))
    print(f"{case.name}: {len(lines[window].errors)} recordings")
    print("| hop | error | width | covered | error of parameters | width | covered |\n|---|---|---|---|---|---|---|")
    for hop in hops(window):
        cells = [*lines[hop].row(lines[hops(window)[0]])]
        cells += [*parameters[hop].row(parameters[hops(window)[0]])] if case.parameters else []
        print(f"| {hop} | " + " | ".join(f"{cell:.3f}" for cell in cells) + " |" + " – |" * (6 - len(cells)))
    print()


def compare(folder: Path) -> None:
    """Print how far the mean of a recording of two motors on a coupling is from that at a twentieth of the window."""
    data = loadmat(folder / "motorbench" / "MultisineTypeA.mat")
    u, y = (np.ravel(data[name])[2500 * 3 :].astype(float) for name in ("iq_adx", "omega_max"))
    settings = Settings(lines=Lines.parse("11:250:1", 2500, 2500), output="y", input="u", estimator="direct")
    reference = mean((u, u, y), settings)
    print("two motors on a coupling, 17 periods\n| hop | largest difference, sigma | width |\n|---|---|---|")
    for hop in hops(2500):
        response = mean((u, u, y), replace(settings, hop=hop))
        both = response.valid & reference.valid
        difference = np.abs(response.value - reference.value)[both] / reference.sigma[both]
        width = np.median(response.bound()[both] / reference.bound()[both])
        print(f"| {hop} | {difference.max():.2f} | {width:.3f} |")


if __name__ == "__main__":
    for each in (servo(8), servo(40), under_noise()):
        measure(each)
    for folder in sys.argv[1:]:
        compare(Path(folder))
