"""Fits on the simulated axis: at standstill against the Cramér–Rao bound, and along a stroke with the correction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtri

from livebode import Block, Parameters, Responses, Settings, Tracker
from livebode.fitting import EvaluationGrid, Fitter, TwoMass
from livebode.fitting.problem import MeasuredRows, Problem
from livebode.motion import MotionCorrection
from livebode.simulation import BeltAxis, Friction, Mechanics, Sensor, SimulatedAxis, Standstill, Strokes
from studies.common import EXCITATION, RATE_HZ, SIGMA, WINDOW, Floats, lines, rms
from studies.result import Result, Study, Table, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RUNS, PERIODS, PLACE_M = 1000, (30, 10), 0.8
FORCES_N = (0.0, 2.0, 5.0, 15.0)
NAMES = ("Js", "mL", "Keff", "bs")
MODEL = TwoMass(radius_m=0.019)
FROZEN = Mechanics(frozen_position_m=PLACE_M)
TRUTH = np.array([FROZEN.inertia_kg_m2, FROZEN.load_kg, FROZEN.stiffness_n_per_m, FROZEN.damping_n_s_per_m, 0, 0, 0])
AFTER_S = 0.1  # of an acceleration's end: what is judged of a stroke begins this long after it
PAPER = (
    "no numbers; these are ours. At standstill a response is the average of 30 windows of 100 ms. Along a stroke it is "
    "one window of 100 ms with the correction of motion, sigma from detection lines."
)


def fitted_at_standstill(runs: int, periods: int = PERIODS[0]) -> Parameters:
    """Fits of the two masses to averages over `periods`, one run after the other, in the periodic state."""
    span = periods * WINDOW
    lead = round(10 * RATE_HZ)
    axis = BeltAxis(
        mechanics=FROZEN, motion=Standstill(position_m=PLACE_M), excitation_n_m=EXCITATION,
        sensor=Sensor(noise_rad_per_s=SIGMA), seconds=(lead + runs * span) / RATE_HZ, seed=3,
    )  # fmt: skip
    settings = Settings(
        lines=lines(), output="velocity", input="u", excitation="w", hop=WINDOW, average=True, forgetting=1.0
    )
    blocks = SimulatedAxis(axis).blocks(["w", "u", "velocity"], block_samples=span, real_time=False)
    # From the first whole span in the periodic state on, each span is a run of its own.
    runs_of_their_own = (b for b in blocks if b.start >= lead + span - lead % span and len(b) == span)
    found = [Tracker(settings).process(Block(b.data, b.channels, b.rate_hz))[-1:] for b in runs_of_their_own]
    return Fitter(MODEL).process(Responses.join(found))


def least_variance(periods: int = PERIODS[0]) -> Floats:
    """Cramér–Rao bound of the logarithms of Js, mL, Keff, bs: white noise on y makes sigma² = N·σ²/|U|² a period."""
    grid = EvaluationGrid.of(lines())
    u = np.abs(BeltAxis(mechanics=FROZEN).closed_loop(PLACE_M).responses(grid.frequency_hz)[1]) * WINDOW / 2
    sigma = np.sqrt(WINDOW / periods) * SIGMA / u
    exact = MeasuredRows(MODEL.at(TRUTH, grid)[np.newaxis], sigma[np.newaxis], np.ones((1, sigma.size), dtype=bool))
    solution, _ = Problem(MODEL, grid).solve(exact, np.sqrt(2) / exact.sigma, TRUTH[np.newaxis])
    left = np.sqrt(2) / sigma[:, np.newaxis] * solution.slope[0]
    return np.diag(np.linalg.inv((left.conj().T @ left).real))


def moving(seed: int) -> tuple[Parameters, BeltAxis]:
    """Fits to single windows of a stroke at 0.38 m/s, corrected, at full speed."""
    motion = Strokes()
    speed = motion.cycle(RATE_HZ)[1]
    half = speed.size // 2
    axis = BeltAxis(
        motion=motion, excitation_n_m=EXCITATION, sensor=Sensor(noise_rad_per_s=SIGMA),
        seconds=(half + WINDOW) / RATE_HZ, seed=seed,
    )  # fmt: skip
    block, _ = SimulatedAxis(axis).run()
    settings = Settings(lines=lines(), output="velocity", input="u", excitation="w", schedule="x", noise="quiet")
    correction = MotionCorrection(settings, radius_m=0.019, chunk_samples=half)
    responses = Responses.join([correction.process(block), correction.finish()])
    found = Fitter(MODEL).process(responses)
    full = np.flatnonzero(speed[:half] >= motion.speed_m_per_s * (1 - 1e-9))
    first = full[0] + round(AFTER_S * RATE_HZ)
    return found[(responses.first >= first) & (responses.sample <= full[-1])], axis


def at_standstill(runs: int, periods: int) -> tuple[Floats, Floats, Floats]:
    """Errors over sigma (runs, 4), mean square errors over the least variance, coverage of the 95 % bounds."""
    still = fitted_at_standstill(runs, periods)
    z = (still.value - TRUTH)[:, :4] / still.sigma[:, :4]
    ratio = np.nanmean(np.log(still.value[:, :4] / TRUTH[:4]) ** 2, axis=0) / least_variance(periods)
    return z, ratio, np.mean(np.abs(z) <= ndtri(0.975), axis=0)


def rubbing(short: bool) -> Table:
    """Single windows at standstill under Coulomb friction of the cart."""
    rows = []
    for force in FORCES_N[::3] if short else FORCES_N:
        axis = BeltAxis(
            motion=Standstill(position_m=PLACE_M), excitation_n_m=EXCITATION, friction=Friction(load_coulomb_n=force),
            sensor=Sensor(noise_rad_per_s=SIGMA), seconds=4.0, seed=1,
        )  # fmt: skip
        settings = Settings(lines=lines(), output="velocity", input="u", excitation="w", hop=80, noise="quiet")
        responses = Tracker(settings).process(SimulatedAxis(axis).run()[0])[60:]
        truth = MODEL.at(TRUTH, EvaluationGrid.of(lines()))
        db = 20 * np.log10(np.abs(responses.value.mean(axis=0) / truth))
        found = Fitter(MODEL).process(responses)
        keff = f"{100 * (np.median(found['Keff'][found.ok]) / TRUTH[2] - 1):+.1f}" if found.ok.any() else "none"
        rows.append((force, float(np.abs(db).max()), *shares(found.ok, found.status == "friction"), keff))
    header = (
        "friction, N",
        "largest error of \\|G\\|, dB",
        "valid fits, %",
        "status friction, %",
        "Keff of the valid fits, %",
    )
    return Table("Standstill under dry friction of the cart, single windows", header, rows)


def shares(*which: np.ndarray) -> tuple[float, ...]:
    return tuple(100 * float(np.mean(w)) for w in which)


def measure(short: bool = False) -> Result:
    runs = 60 if short else RUNS
    z, ratio, cover = at_standstill(runs, PERIODS[0])
    _, *fewer = at_standstill(runs, PERIODS[1])
    rows = [(n, *(float(x) for x in row)) for n, *row in zip(NAMES, ratio, 100 * cover, fewer[0], 100 * fewer[1])]
    caption = (
        f"Standstill, about {runs} runs: mean square error over the Cramér–Rao bound, coverage of 95 % bounds in %"
    )
    header = [f"{what}, {p} windows" for p in PERIODS for what in ("over the bound", "coverage")]
    tables = [Table(caption, ("parameter", *header), rows)]
    worst = float(np.max(np.abs(cover - 0.95)))
    verdicts = [
        Verdict("standstill: worst variance of Js, mL, Keff, bs over the Cramér–Rao bound", float(ratio.max()), 1.2),
        Verdict("standstill: coverage of the 95 % bounds, largest difference from 95 %, points", 100 * worst, 2.0),
    ]
    errors, curves = [], {"z": z}
    for seed in range(1 if short else 6):
        found, axis = moving(seed)
        m = axis.mechanics
        keff, js = found["Keff"] / m.stiffness_at(found.schedule), found["Js"] / m.inertia_kg_m2
        held = np.abs(found["Keff"] - m.stiffness_at(found.schedule)) <= found.bound()[:, found.index("Keff")]
        errors.append((seed, *(100 * float(rms(x[found.ok] - 1)) for x in (keff, js)), *shares(found.ok, held)))
        if seed == 0:
            curves |= {"stroke": found, "stiffness": m.stiffness_at(found.schedule), "inertia": m.inertia_kg_m2}
    along = ("seed", "Keff, rms in %", "Js, rms in %", "valid fits, %", "Keff within its 95 % bound, %")
    tables.append(Table("One window of 100 ms along a stroke at 0.38 m/s, corrected", along, errors))
    tables.append(rubbing(short))
    keff, js = (float(rms(np.array([e[i] for e in errors]))) for i in (1, 2))
    verdicts += [
        Verdict("stroke: Keff of a window, rms in %", keff, 0.65),
        Verdict("stroke: Js of a window, rms in %", js, 0.4),
    ]
    return Result(tables, verdicts, curves)


def draw(result: Result) -> Figure:
    from studies.drawing import LIGHT, figure_of

    facts = "σ = 0.1 rad/s; left: standstill at 0.8 m; else one stroke at 0.38 m/s, windows of 100 ms, 95 % bounds"
    with figure_of("Fits on the simulated axis", facts, (11.0, 4.6)) as figure:
        left, middle, right = figure.subplots(1, 3)
        z = result.curves["z"]
        expected = ndtri((np.arange(len(z)) + 0.5) / len(z))
        for i, (name, colour) in enumerate(zip(NAMES, LIGHT.traces)):
            left.plot(expected, np.sort(z[:, i]), color=colour, linewidth=1.3, label=name)
        left.plot([-3, 3], [-3, 3], color=LIGHT.ink, linewidth=0.8, dashes=(4, 2))
        left.set_xlabel("normal quantile")
        left.set_ylabel("error over sigma, ascending")
        left.legend(loc="upper left")
        found = result.curves["stroke"]
        for axes, name, truth, scale, unit in (
            (middle, "Keff", result.curves["stiffness"], 1e-3, "kN/m"),
            (right, "Js", np.full(len(found), result.curves["inertia"]), 1e3, "g m²"),
        ):
            value, bound = scale * found[name], scale * found.bound()[:, found.index(name)]
            axes.fill_between(found.schedule, value - bound, value + bound, color=LIGHT.run, alpha=0.25, linewidth=0)
            axes.plot(found.schedule, value, color=LIGHT.run, linewidth=1.2, label="fit")
            axes.plot(found.schedule, scale * truth, color=LIGHT.ink, linewidth=0.9, dashes=(4, 2), label="truth")
            axes.set_xlabel("cart position, m")
            axes.set_ylabel(f"{name}, {unit}")
            axes.legend(loc="upper right")
    return figure


STUDY = Study("fits", "Fits: bounds and errors", PAPER, measure, draw)
