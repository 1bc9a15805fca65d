"""Tuning with a mode around and above the highest line: `python -m studies.tune_modes_above [machines] [seed]`.

The machines are chains of four inertias (motor, coupling, disc, belt, carriage, tip) with random stiffnesses, a random
damping ratio of each mode, friction, a delay that is not a whole number of ticks, and a quantised encoder whose
differences are the velocity. They are built here as state space with SciPy and simulated tick by tick; nothing of
`livebode.simulation` is used, and livebode fits no such model. The mode of the stiffest spring is at 0.8 … 5 times the
highest line, or there is none.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import brentq

from livebode import PID, Lines, Loop, Responses, TuneError, multisine
from livebode_control.tuning import ControllerProposal, LoopSpecification, PredictedMargins, tune
from livebode_control.tuning.predicted import predicted
from studies.result import Table
from studies.tune import keeps, show

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Lines, rate and window: the first are those of wings/control/docs/tune.md.
LINES = (
    ("4:100:2, 104:400:8", 4000.0, 2000),
    ("2:160:2, 166:700:6", 4000.0, 2000),
    ("4:80:4, 88:320:8", 2000.0, 1000),
    ("5:120:5, 130:600:10", 8000.0, 3200),
)
LIMITS = LoopSpecification()
_PERIODS, _SETTLING = 12, 4
_NO_MODE = 0.25  # share of the machines without a mode above the lines
_GROUPS = ((0.8, 1.0), (1.0, 1.25), (1.25, 1.6), (1.6, 2.0), (2.0, 3.0), (3.0, 5.0))


@dataclass(frozen=True)
class Chain:
    """A machine as state space, sampled with its delay; the output is the difference of two encoder angles.

    Attributes
    ----------
    a, b
        x(k + 1) = a·x(k) + b·u(k − ticks) of states and the last torque, with the rest of the delay.
    ticks
        Whole ticks of delay.
    angle
        Row that gives the angle.
    rate_hz, step_rad
        Of the drive, and of the encoder.
    modes_hz
        Ascending.
    mode_over_top
        The mode of the stiffest spring over the highest line; NaN without one.
    lines
        The measured lines.
    loop
        The described loop.
    """

    a: Floats
    b: Floats
    ticks: int
    angle: Floats
    rate_hz: float
    step_rad: float
    modes_hz: Floats
    mode_over_top: float
    lines: Lines
    loop: Loop

    def response(self, frequency_hz: Floats) -> Complex:
        """Velocity over torque."""
        z = np.exp(2j * np.pi * frequency_hz / self.rate_hz)
        rows = np.linalg.solve(z[:, None, None] * np.eye(len(self.a)) - self.a, self.b[:, None])[..., 0]
        return np.asarray(rows @ self.angle * z**-self.ticks * (1 - 1 / z) * self.rate_hz)

    def closed_loop_stable(self, feedback: Complex, frequency_hz: Floats, from_feedback: Complex) -> bool:
        """Whether the loop is stable where another feedback is: 1 + L turns as often around 0."""
        plant = self.response(frequency_hz)
        turns = [np.unwrap(np.angle(1 + plant * f)) for f in (feedback, from_feedback)]
        return abs((turns[0][-1] - turns[0][0]) - (turns[1][-1] - turns[1][0])) < np.pi

    @property
    def dense_hz(self) -> Floats:
        """Frequencies that miss no mode of a damping of 0.3 % up to half the rate."""
        around = [np.linspace(0.95, 1.05, 401) * f for f in self.modes_hz]
        every = np.concatenate([np.geomspace(0.02, self.rate_hz / 2.0001, 12000), *around])
        return np.unique(every[every < self.rate_hz / 2.0001])


def machines(seed: int) -> Iterator[Chain]:
    """Machines in random order."""
    rng = np.random.default_rng(seed)
    while True:
        text, rate_hz, window = LINES[rng.integers(len(LINES))]
        lines = Lines.parse(text, rate_hz=rate_hz, window=window)
        if (found := _drawn(rng, lines)) is not None:
            yield found


def _drawn(rng: np.random.Generator, lines: Lines) -> Chain | None:
    """A machine; None where the draw has another mode above 0.7 of the highest line, or no stable loop."""
    top, rate_hz = float(lines.frequency_hz[-1]), lines.rate_hz
    over = float("nan") if rng.random() < _NO_MODE else float(np.exp(rng.uniform(np.log(0.8), np.log(5.0))))
    if over * top > 0.49 * rate_hz:
        return None
    inertia = 10 ** rng.uniform(-3.6, -2.4) * 10 ** rng.uniform(-0.6, 0.4, 4)
    springs = inertia.sum() * (2 * np.pi * np.exp(rng.uniform(np.log(12), np.log(0.3 * top), 3))) ** 2
    stiff = int(rng.integers(3))
    if np.isnan(over):
        # Two inertias that a rigid shaft joins are one.
        inertia = np.concatenate([inertia[:stiff], [inertia[stiff] + inertia[stiff + 1]], inertia[stiff + 2 :]])
        springs = np.delete(springs, stiff)
    else:

        def highest(log_k: float) -> float:
            some = springs.copy()
            some[stiff] = np.exp(log_k)
            return float(np.log(_modes(inertia, some)[0][-1] / (over * top)))

        ends = np.log([springs.min() * 1e-2, springs.max() * 1e6])
        if highest(ends[0]) > 0 or highest(ends[1]) < 0:
            return None
        springs[stiff] = np.exp(brentq(highest, *ends))
    modes_hz, shapes = _modes(inertia, springs)
    if modes_hz[-1 if np.isnan(over) else -2] > 0.7 * top:
        return None
    ratio = np.exp(rng.uniform(np.log(0.003), np.log(0.05), len(modes_hz)))
    omega = 2 * np.pi * np.append(0.0, modes_hz)
    rub = np.append(rng.uniform(0, 5), 2 * ratio * omega[1:])
    n = len(omega)
    # Modal coordinates: mass one, damping and stiffness diagonal.
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(omega**2), -np.diag(rub)]])
    b = np.append(np.zeros(n), shapes[0])
    ticks, part = divmod(rng.uniform(0.2e-3, 1.2e-3) * rate_hz, 1.0)
    a, b = _with_part_of_a_tick(a, b, part, 1 / rate_hz)
    angle = np.concatenate([shapes[0], np.zeros(n), [0.0]])
    step = 2 * np.pi / 2.0 ** rng.integers(18, 24)
    described = PID(gain=inertia.sum() * 2 * np.pi * rng.uniform(2, 10), integral_time_s=0.2, rate_hz=rate_hz)
    found = Chain(a, b, int(ticks), angle, rate_hz, step, modes_hz, over, lines, Loop(described))
    return found if _stable_eigenvalues(found) else None


def _modes(inertia: Floats, springs: Floats) -> tuple[Floats, Floats]:
    """Frequencies in Hz without the rigid one, and shapes with modal mass one, shape (inertias, modes)."""
    k = np.zeros((len(inertia), len(inertia)))
    for i, spring in enumerate(springs):
        k[i : i + 2, i : i + 2] += spring * np.array([[1, -1], [-1, 1]])
    root = np.sqrt(inertia)
    square, vectors = np.linalg.eigh(k / root / root[:, None])
    return np.sqrt(square[1:]) / (2 * np.pi), vectors / root[:, None]


def _with_part_of_a_tick(a: Floats, b: Floats, part: float, tick_s: float) -> tuple[Floats, Floats]:
    """Sampled, with the torque of the last tick as a state: it acts for the first part of a tick."""

    def held(span_s: float) -> tuple[Floats, Floats]:
        n = len(a)
        whole = expm(np.block([[a, b[:, None]], [np.zeros((1, n + 1))]]) * span_s)
        return whole[:n, :n], whole[:n, n]

    (late, new), (whole, _) = held((1 - part) * tick_s), held(tick_s)
    old = late @ held(part * tick_s)[1]
    return np.block([[whole, old[:, None]], [np.zeros((1, len(a) + 1))]]), np.append(new, 1.0)


def _stable_eigenvalues(of: Chain) -> bool:
    """Whether the described loop is stable, from the eigenvalues of all states."""
    inner = of.loop.feedback
    assert isinstance(inner, PID)
    n, ticks = len(of.a), of.ticks
    # States: machine, previous angle, torques under way, integral.
    size = n + 1 + ticks + 1
    m = np.zeros((size, size))
    y = np.zeros(size)
    y[:n], y[n] = of.angle * of.rate_hz, -of.rate_hz
    integral = np.zeros(size)
    integral[-1] = 1.0
    integral -= y / (of.rate_hz * inner.integral_time_s)
    u = inner.gain * (integral - y)
    acting = np.eye(size)[n + 1] if ticks else u
    m[:n, :n] = of.a
    m[:n] += np.outer(of.b, acting)
    m[n, :n] = of.angle
    for i in range(ticks):
        m[n + 1 + i] = np.eye(size)[n + 2 + i] if i + 1 < ticks else u
    m[-1] = integral
    poles = np.linalg.eigvals(m)
    poles = np.delete(poles, np.argmin(np.abs(poles - 1)))  # the angle itself: only its differences are fed back
    return bool(np.max(np.abs(poles)) < 1 - 1e-5)


def measured(of: Chain, seed: int) -> Responses:
    """Mean of periods of a recording: excitation added to the torque, angles rounded, friction noise in the torque."""
    rng = np.random.default_rng(seed)
    inner = of.loop.feedback
    assert isinstance(inner, PID)
    window = of.lines.window
    one = multisine(of.lines)[:window]
    plant = of.response(of.lines.frequency_hz)
    # So that most lines are known to 0.3 … 3 %.
    amplitude = np.sqrt(of.lines.frequency_hz.size) * of.rate_hz * of.step_rad / np.quantile(np.abs(plant), 0.2) * 0.1
    w = np.tile(one / np.std(one) * amplitude * np.exp(rng.uniform(-1, 1)), _SETTLING + _PERIODS)
    rough = rng.uniform(0.002, 0.03) * np.std(w) * rng.standard_normal(w.size)
    u, y = np.empty_like(w), np.empty_like(w)
    x, before, integral = np.zeros(len(of.a)), 0.0, 0.0
    under_way = [0.0] * of.ticks
    for k in range(w.size):
        angle = np.floor(of.angle @ x / of.step_rad + 0.5) * of.step_rad
        y[k], before = (angle - before) * of.rate_hz, angle
        integral -= y[k] / (of.rate_hz * inner.integral_time_s)
        u[k] = inner.gain * (integral - y[k]) + w[k]
        under_way.append(u[k])
        x = of.a @ x + of.b * (under_way.pop(0) + rough[k])
    at = np.rint(of.lines.frequency_hz * window / of.rate_hz).astype(int)
    spectra = np.fft.rfft(np.stack([u, y])[:, _SETTLING * window :].reshape(2, _PERIODS, window))[..., at]
    (us, ys), (um, ym) = spectra, spectra.mean(axis=1)
    value = ym / um
    sigma = np.sqrt(np.sum(np.abs(ys - value * us) ** 2, axis=0) / (_PERIODS - 1) / _PERIODS) / np.abs(um)
    row, ones = np.zeros(1, dtype=np.int64), np.ones((1, at.size))
    dof = row + 2.0 * (_PERIODS - 1)
    return Responses(of.lines, value[None], sigma[None], dof, ones, ones > 0, row, row, row + 0.0, row + 0.0)


def exact(of: Chain) -> Responses:
    """The true response at the lines, without noise."""
    truth = of.response(of.lines.frequency_hz)[np.newaxis]
    ones, row = np.ones(truth.shape), np.zeros(1, dtype=np.int64)
    return Responses(of.lines, truth, 0 * ones, row + np.inf, ones, ones > 0, row, row, row + 0.0, row + 0.0)


def true_margins(of: Chain, proposal: ControllerProposal) -> PredictedMargins | None:
    """Margins of the true loop; None where it is unstable."""
    f = of.dense_hz
    feedback = proposal.feedback.model.response(f)
    if not of.closed_loop_stable(feedback, f, of.loop.feedback_at(f)):
        return None
    loop = (of.response(f) * feedback)[None]
    return predicted(f, loop, np.zeros(loop.shape))


@dataclass(frozen=True)
class Outcome:
    """What became of a machine.

    Attributes
    ----------
    over
        Its mode over the highest line; NaN without one.
    result
        "kept", "broken" or "unstable" on the true machine, or "refused: " and the reason.
    share
        True bandwidth over that of the same search with exact lines; NaN where it is not known.
    """

    over: float
    result: str
    share: float = float("nan")


def outcome(of: Chain, number: int) -> Outcome:
    """Of the recording with this seed."""
    try:
        found = tune(measured(of, number), of.loop, LIMITS, loop_checked=True)
    except TuneError as error:
        return Outcome(of.mode_over_top, f"refused: {_reason(error)}")
    truth = true_margins(of, found)
    if truth is None:
        return Outcome(of.mode_over_top, "unstable")
    share = truth.bandwidth_hz / _full_hz(of) if np.isnan(of.mode_over_top) else float("nan")
    return Outcome(of.mode_over_top, "kept" if keeps(truth, found.promised) else "broken", share)


def _reason(error: TuneError) -> str:
    """The code, and whether it is what may be above the lines."""
    return f"{error.code}, above" if "above them" in str(error) else error.code


def _full_hz(of: Chain) -> float:
    """True bandwidth with exact lines; NaN where nothing is proposed."""
    try:
        truth = true_margins(of, tune(exact(of), of.loop, LIMITS, loop_checked=True))
    except TuneError:
        return float("nan")
    return float("nan") if truth is None else truth.bandwidth_hz


def show_outcomes(found: list[Outcome], seed: int) -> None:
    """A row for each range of the mode, and the reasons of the refusals."""
    groups = [(f"{low:g} … {high:g}", [one for one in found if low <= one.over < high]) for low, high in _GROUPS]
    rows = []
    for name, some in (*groups, ("none", [one for one in found if np.isnan(one.over)]), ("all", found)):
        tally = Counter(one.result.partition(":")[0] for one in some)
        numbers = [tally[word] for word in ("refused", "kept", "broken", "unstable")]
        known = [one.share for one in some if np.isfinite(one.share)]
        rows.append((name, len(some), *numbers, f"{np.median(known):.2f}" if known else "–"))
    header = ("mode/highest line", "machines", "refused", "kept", "broken", "unstable", "bandwidth/full")
    show(Table(f"Modes around and above the highest line, seed {seed}", header, rows))
    for which, without in (("with", False), ("without", True)):
        some = [one.result for one in found if bool(np.isnan(one.over)) is without and one.result.startswith("refused")]
        print(f"{which} such a mode: {', '.join(f'{count} {reason}' for reason, count in Counter(some).most_common())}")


def main(count: int = 300, seed: int = 101) -> None:
    show_outcomes([outcome(one, number) for number, one in zip(range(count), machines(seed))], seed)


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
