"""The axis in motion: the error of a window's response without and with the correction of motion.

Truth is the local linearisation at the window's centre, sampled at the loop's rate.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from livebode.core import Block, Responses
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine
from livebode.fitting.two_masses import fit_windows
from livebode.motion import MotionCorrection
from livebode.simulation import BeltAxis, Friction, Mechanics, Sensor, SimulatedAxis, Strokes
from studies.common import RATE_HZ, WINDOW, correct, decibels, lines, rms
from studies.drawing import LIGHT, figure_of
from studies.dry_friction import dwelling, smooth
from studies.result import Result, Study, Table, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LINES = lines()
SEEDS = 6
PAPER = (
    "The choice of N is a compromise between noise and lag; the effect of motion on a window is not corrected. The "
    "study is ours."
)
AFTER_S = 0.1  # what is judged: windows that begin this long after the acceleration's end, up to its next start
SETTINGS = Settings(lines=LINES, output="velocity", input="u", excitation="w", schedule="x")


@dataclass(frozen=True, eq=False)
class Judged:
    """Errors of the judged windows of one run: |G| in dB (rows, lines), Keff and Js in percent (rows,)."""

    db: np.ndarray
    keff: np.ndarray
    js: np.ndarray

    def rms(self) -> dict[str, float]:
        return {name: float(np.sqrt(np.mean(getattr(self, name) ** 2))) for name in ("db", "keff", "js")}


def axis(sigma: float, strokes: int = 1, seed: int = 0, **options: Any) -> BeltAxis:
    """Forward and return strokes, whole dwells included."""
    motion = options.pop("motion", Strokes())
    half = motion.cycle(RATE_HZ)[0].size // 2
    sensor = Sensor(noise_rad_per_s=sigma, encoder_counts_per_turn=options.pop("counts", 0))
    seconds = (half * strokes + WINDOW) / RATE_HZ
    return BeltAxis(
        motion=motion, excitation_n_m=multisine(LINES), sensor=sensor, seconds=seconds, seed=seed, **options
    )


def corrected(run: BeltAxis, block: Block, settings: Settings = SETTINGS, **options: Any) -> Responses:
    """The run through a MotionCorrection with a stroke a chunk."""
    stroke = run.motion.cycle(RATE_HZ)[0].size // 2
    return correct(run, block, stroke, settings, **options)


def cruising(run: BeltAxis, sample: np.ndarray, after_s: float = AFTER_S) -> np.ndarray:
    """Rows whose window, and `after_s` before it, lie in a motion at constant speed."""
    speed = run.motion.cycle(RATE_HZ)[1]
    n = np.arange(int(sample.max()) + 1) % speed.size
    changes = np.cumsum((speed[n] != speed[n - 1]) | (speed[n] == 0))
    first = np.maximum(sample - WINDOW + 1 - round(after_s * RATE_HZ), 0)
    return changes[sample] == changes[first]


def truth_at(run: BeltAxis, position_m: np.ndarray) -> np.ndarray:
    return np.array([run.linear(float(x)).sampled(RATE_HZ).response(LINES.frequency_hz) for x in position_m])


def start_at(run: BeltAxis, position_m: np.ndarray) -> np.ndarray:
    """The fit of a window starts 5 % off the truth in all four parameters; it ends at the same place from 10 %."""
    m, arm = run.mechanics, run.mechanics.radius_m**2
    masses = np.ones((2, position_m.size)) * np.array([[m.inertia_kg_m2], [m.load_kg * arm]])
    belt = np.array([m.stiffness_at(position_m), m.damping_at(position_m)]) * arm
    return np.log(1.05 * np.vstack([masses, belt]).T)


def judge(
    run: BeltAxis, responses: Responses, position_m: np.ndarray | None = None, after_s: float = AFTER_S
) -> Judged:
    rows = np.flatnonzero(responses.valid.all(axis=1) & cruising(run, responses.sample, after_s))
    at = (responses.schedule if position_m is None else position_m)[rows]
    return against(run, responses.value[rows], at)


def against(run: BeltAxis, value: np.ndarray, at: np.ndarray) -> Judged:
    truth, m = truth_at(run, at), run.mechanics
    # White noise on y makes the error of a response n/|U|; U/W = 1/(1 + F·G).
    weight = 1 / np.abs(1 + run.drive.loop().feedback_at(LINES.frequency_hz) * truth)
    found, _ = fit_windows(value, weight, LINES.z, RATE_HZ, start_at(run, at))
    keff, js = np.exp(found[:, 2]) / m.radius_m**2 / m.stiffness_at(at), np.exp(found[:, 0]) / m.inertia_kg_m2
    return Judged(20 * np.log10(np.abs(value / truth)), 100 * (keff - 1), 100 * (js - 1))


def noise_floor_db(run: BeltAxis, at: np.ndarray, sigma: float) -> float:
    """rms of |G| in dB from white noise alone, to first order: half of sigma² = N·σ²/|U_k|² falls on the magnitude."""
    truth = truth_at(run, at)
    u = WINDOW / 2 / np.abs(1 + run.drive.loop().feedback_at(LINES.frequency_hz) * truth)
    return float(20 / np.log(10) * np.sqrt(np.mean(WINDOW * sigma**2 / (2 * np.abs(u * truth) ** 2))))


def ways(run: BeltAxis, block: Block) -> dict[str, Judged]:
    """Every way on one recording."""
    plain, hann = Tracker(SETTINGS).process(block), Tracker(replace(SETTINGS, hann=True)).process(block)
    loop = replace(SETTINGS, loop=run.drive.loop())
    return {
        "newest sample": judge(run, plain, block["x"][plain.sample]),
        "centre": judge(run, plain),
        "centre, Hann": judge(run, hann),
        "model driven by w": judge(run, corrected(run, block, loop, driven_by="excitation")),
        "model driven by u, quotient": judge(run, corrected(run, block, quotient=True)),
        "model driven by u": judge(run, corrected(run, block)),
    }


def pooled(parts: list[Judged]) -> Judged:
    return Judged(*(np.concatenate([getattr(p, name) for p in parts]) for name in ("db", "keff", "js")))


def averaged(run: BeltAxis, responses: Responses, ways: tuple[bool, ...]) -> Judged:
    """The mean over the strokes forward (True) and backward (False), one window of each stroke in a cell of 8 mm."""
    cycle = run.motion.cycle(RATE_HZ)
    rows = np.flatnonzero(responses.valid.all(axis=1) & cruising(run, responses.sample))
    sample = responses.sample[rows]
    rows = rows[np.isin(cycle[1][sample % cycle[0].size] > 0, ways)]
    place = responses.schedule[rows]
    edges = np.linspace(place.min(), place.max(), 151)  # a hop is 1.9 mm: a cell holds four windows of a stroke
    cell = np.digitize(place, edges[1:-1])
    stroke = responses.sample[rows] // (cycle[0].size // 2)
    value, at = [], []
    for c in range(150):
        inside = cell == c
        # One window of each stroke, the one nearest to the cell's middle: windows that overlap share their noise.
        if not inside.any():
            continue
        middle = (edges[c] + edges[c + 1]) / 2
        chosen = [
            min(rows[inside & (stroke == s)], key=lambda i: abs(responses.schedule[i] - middle))
            for s in np.unique(stroke[inside])
        ]
        here = responses.schedule[chosen]
        value.append(responses.value[chosen].mean(axis=0))
        at.append(here.mean())
    return against(run, np.array(value), np.array(at))


def model_inertias(run: BeltAxis, block: Block) -> np.ndarray:
    """Js of the model that moves, one for each stroke."""
    stroke = run.motion.cycle(RATE_HZ)[0].size // 2
    correction, found = MotionCorrection(SETTINGS, radius_m=run.mechanics.radius_m, chunk_samples=stroke), []
    for at in range(WINDOW, len(block), stroke):  # a chunk is fitted when a window more has come
        correction.process(block.cut(0 if at == WINDOW else at, at + stroke))
        found.append(correction.model.inertia_kg_m2)
    return np.array(found)


def within_bounds(run: BeltAxis, responses: Responses) -> np.ndarray:
    """Whether the truth lies within bound(1) and bound(2), shape (2, rows, lines), wherever sigma is known."""
    rows = np.flatnonzero(responses.valid.all(axis=1) & np.isfinite(responses.dof))
    error = np.abs(responses.value[rows] - truth_at(run, responses.schedule[rows]))
    return np.array([error <= responses.bound(c)[rows] for c in (1, 2)])


def magnitude_db(run: BeltAxis, responses: Responses) -> float:
    """Rms error of |G| while cruising."""
    rows = np.flatnonzero(responses.valid.all(axis=1) & cruising(run, responses.sample))
    return float(rms(decibels(responses.value[rows] / truth_at(run, responses.schedule[rows]))))


class Campaign:
    """All measurements, as tables and verdicts."""

    def __init__(self) -> None:
        self.tables: list[Table] = []
        self.verdicts: list[Verdict] = []
        self.numbers: dict[str, Any] = {}

    def target(self, what: str, value: float, most: float, why: str) -> None:
        self.verdicts.append(Verdict(what, value, most, why=why))

    def table(self, title: str, key: str, found: dict[str, Judged]) -> dict[str, dict[str, float]]:
        rows = {name: judged.rms() for name, judged in found.items()}
        header = ("rms over windows and lines", "\\|G\\|, dB", "Keff, %", "Js, %")
        self.tables.append(Table(title, header, [(name, *row.values()) for name, row in rows.items()]))
        self.numbers[key] = rows
        return rows

    def per_window(self, seeds: int) -> None:
        runs = [axis(0.1, seed=seed) for seed in range(seeds)]
        blocks = [SimulatedAxis(run).run()[0] for run in runs]
        each = [ways(run, block) for run, block in zip(runs, blocks)]
        found = {name: pooled([way[name] for way in each]) for name in each[0]}
        rows = self.table(f"σ = 0.1 rad/s, {seeds} seeds, each stroke 0.25 → 1.6 m at 0.38 m/s", "sigma_0.1", found)
        floor = noise_floor_db(runs[0], np.linspace(0.3, 1.55, 100), 0.1)
        per_line = np.sqrt(np.mean(found["model driven by u"].db ** 2, axis=0))
        heads = (*(f"{f:g} Hz" for f in LINES.frequency_hz), "white noise alone, all lines")
        self.tables.append(Table("Model driven by u: error of \\|G\\| by line, rms dB", heads, [(*per_line, floor)]))
        ours, noise = rows["model driven by u"], f"white noise alone causes {floor:.3g} dB of |G|"
        self.target("per window, |G| in dB", ours["db"], 0.15, noise)
        self.target("per window, Keff in %", ours["keff"], 0.65, noise)
        self.target("per window, Js in %", ours["js"], 0.4, noise)

    def noise_free(self) -> None:
        run = axis(0.0)
        block, _ = SimulatedAxis(run).run()
        rows = self.table("No noise", "sigma_0", ways(run, block))
        why = "the difference between model and machine remains"
        self.target("without noise, |G| in dB", rows["model driven by u"]["db"], 0.05, why)
        loop = replace(SETTINGS, loop=run.drive.loop())
        by_w, by_u = corrected(run, block, loop, driven_by="excitation"), corrected(run, block)
        self.table(
            "No noise, windows from this time after acceleration on",
            "settling",
            {
                f"driven by {name}, {after_s:g} s after acceleration": judge(run, responses, after_s=after_s)
                for name, responses in (("w", by_w), ("u", by_u))
                for after_s in (0.0, 0.1, 0.3, 1.0)
            },
        )

    def ten_strokes(self) -> None:
        run = axis(0.1, strokes=20, seed=100)
        block, _ = SimulatedAxis(run).run()
        raw, ours = Tracker(SETTINGS).process(block), corrected(run, block)
        found = {
            f"{name}, {way}": averaged(run, responses, directions)
            for name, responses in (("centre", raw), ("model driven by u", ours))
            for way, directions in (("forward", (True,)), ("backward", (False,)), ("both, 20 strokes", (True, False)))
        }
        rows = self.table("Ten strokes of each direction averaged, σ = 0.1", "ten_strokes", found)
        ours, single = rows["model driven by u, forward"], self.numbers["sigma_0.1"]["model driven by u"]
        for name, what, most in (("keff", "Keff", 0.3), ("js", "Js", 0.1)):
            least = single[name] / np.sqrt(10)
            why = f"the error of a window is {single[name]:.2g} %; divided by √10 this is {least:.2g} %"
            self.target(f"ten forward strokes, {what} in %", ours[name], most, why)
        js = 100 * float(np.abs(model_inertias(run, block)[::2].mean() / run.mechanics.inertia_kg_m2 - 1))
        self.target(
            "ten forward strokes, Js of the moving model in %",
            js,
            0.1,
            "the model does not contain all effects of the machine",
        )

    def bounds(self, seeds: int) -> None:
        rows = []
        for speed in (0.1, 0.2, 0.38):
            runs = [axis(0.1, strokes=2, seed=seed, motion=Strokes(speed_m_per_s=speed)) for seed in range(seeds)]
            each = [within_bounds(run, corrected(run, SimulatedAxis(run).run()[0])) for run in runs]
            shares = 100 * np.concatenate(each, axis=1).mean(axis=(1, 2))
            rows.append((f"{speed:g} m/s", *shares))
            for c, share, promised, most in zip((1, 2), shares, (63.2, 98.2), (3.0, 1.0)):
                claim = f"{speed:g} m/s, coverage by bound({c}), difference from {promised} %, points"
                self.target(
                    claim, abs(float(share) - promised), most, "sigma does not contain the remaining effect of motion"
                )
        heads = ("forward and return strokes, all windows", "within bound(1), %", "within bound(2), %")
        self.tables.append(Table(f"Bounds after the correction, σ = 0.1, {seeds} seeds", heads, rows))

    def three_masses(self) -> None:
        rows = []
        for sigma in (0.0, 0.1):
            run = axis(sigma, mechanics=Mechanics(masses=3))
            block, _ = SimulatedAxis(run).run()
            plain, hann = Tracker(SETTINGS).process(block), Tracker(replace(SETTINGS, hann=True)).process(block)
            db = [magnitude_db(run, responses) for responses in (plain, hann, corrected(run, block))]
            rows.append((f"{sigma:g}", *db))
            claim = f"three masses, σ = {sigma:g}: error of |G|, corrected over Hann"
            self.target(claim, db[2] / db[1], 1.0, "the free pulley is not in the model")
        heads = ("σ, rad/s", "centre", "Hann", "corrected")
        self.tables.append(
            Table("Three masses compared with their own linearisation, rms of \\|G\\| in dB", heads, rows)
        )

    def friction(self) -> None:
        rows = [dwelling(amplitude, friction) for amplitude in (0.3, 1.0, 3.0) for friction in (0.0, 1.0, 5.0, 15.0)]
        heads = ("N m per line", "friction, N", "uncorrected, dB", "valid windows, dB", "events", "windows invalid, %")
        caption = "Dry friction, dwells of 1 s: worst line of \\|G\\| at standstill of the cart, 95 % of windows"
        self.tables.append(Table(caption, heads, rows))
        found = [(amplitude, *smooth(amplitude, v)) for amplitude in (0.3, 1.0, 3.0) for v in (0.1, 0.38, 0.8, 1.2)]
        heads = ("N m per line", "speed, m/s", "events", "windows invalid, %")
        self.tables.append(Table("The same detection without dry friction", heads, found))
        worst = max(row[3] for row in found)
        self.target(
            "no dry friction: windows marked as held, %",
            worst,
            0.0,
            "another effect that the model lacks is taken for friction",
        )

    def imperfect(self, seeds: int) -> None:
        cases: dict[str, dict[str, Any]] = {
            "friction 15 N": {"friction": Friction(load_coulomb_n=15.0)},
            "20-bit encoder": {"counts": 1 << 20},
            "both": {"friction": Friction(load_coulomb_n=15.0), "counts": 1 << 20},
            "viscous friction 0.01 N m s, 20 N s/m": {
                "friction": Friction(motor_viscous_n_m_s=0.01, load_viscous_n_s_per_m=20.0)
            },
        }
        found = {name: self._pooled(seeds, **case) for name, case in cases.items()}
        rows = self.table(f"Friction and encoder, σ = 0.1, {seeds} seeds, model driven by u", "imperfect", found)
        clean = self.numbers["sigma_0.1"]["model driven by u"]
        for name, what in (("db", "|G|"), ("keff", "Keff"), ("js", "Js")):
            why = "friction and rounding are not in the model"
            self.target(
                f"friction and encoder: error of {what} over that without", rows["both"][name] / clean[name], 1.1, why
            )

    def other_motions(self) -> None:
        motions = {f"forward, {v:g} m/s": Strokes(speed_m_per_s=v) for v in (0.1, 0.2, 0.38, 0.8, 1.2)}
        back = {f"backward, {v:g} m/s": Strokes(start_m=1.6, end_m=0.25, speed_m_per_s=v) for v in (0.2, 0.38, 0.8)}
        both = motions | back | {"S-curve, 0.38 m/s, 40 m/s³": Strokes(jerk_m_per_s3=40.0)}
        found = {}
        for name, motion in both.items():
            found[f"{name}: centre"] = self._pooled(2, raw=True, motion=motion)
            found[f"{name}: corrected"] = self._pooled(2, motion=motion)
        self.table("Other speeds and directions, σ = 0.1, 2 seeds", "motions", found)

    def _pooled(self, seeds: int, raw: bool = False, **case: Any) -> Judged:
        parts = []
        for seed in range(seeds):
            run = axis(0.1, seed=seed, **case)
            block, _ = SimulatedAxis(run).run()
            parts.append(judge(run, Tracker(SETTINGS).process(block) if raw else corrected(run, block)))
        return pooled(parts)

    def cost(self) -> None:
        run = axis(0.1, strokes=4)
        block, _ = SimulatedAxis(run).run()

        def least(work: Any) -> float:
            times = []
            for _ in range(3):
                begun = time.process_time()
                work()
                times.append(time.process_time() - begun)
            return min(times) / len(block) * 1e6

        tracker, ours = least(lambda: Tracker(SETTINGS).process(block)), least(lambda: corrected(run, block))
        heads = ("tracker alone", "corrected", "share of a core at 4 kHz, %")
        self.tables.append(Table("Cost, µs per sample", heads, [(tracker, ours, ours * RATE_HZ / 1e4)]))


def measure(short: bool = False) -> Result:
    campaign, seeds = Campaign(), 1 if short else SEEDS
    campaign.per_window(seeds)
    if not short:
        campaign.noise_free()
        campaign.ten_strokes()
        campaign.imperfect(seeds)
        campaign.other_motions()
        campaign.bounds(3)
        campaign.three_masses()
        campaign.friction()
        campaign.cost()
    return Result(campaign.tables, campaign.verdicts, {"run": axis(0.1, seed=0)})


def draw(result: Result) -> Figure:
    run = result.curves["run"]
    block, _ = SimulatedAxis(run).run()
    facts = "two masses, 0.38 m/s, window 100 ms, noise 0.1 rad/s; one stroke"
    with figure_of("An axis in motion: dated at the centre, and corrected", facts, (9.0, 6.5)) as figure:
        magnitude, stiffness = figure.subplots(2, 1, sharex=True)
        shown = {"window's centre": Tracker(SETTINGS).process(block), "corrected": corrected(run, block)}
        for colour, (label, responses) in zip(LIGHT.traces, shown.items()):
            rows = np.flatnonzero(responses.valid.all(axis=1) & cruising(run, responses.sample))
            judged = judge(run, responses)
            magnitude.plot(responses.schedule[rows], judged.db[:, 2], color=colour, linewidth=1.1, label=label)
            stiffness.plot(responses.schedule[rows], judged.keff, color=colour, linewidth=1.1)
        magnitude.set_ylabel("error of |G| at 60 Hz, dB")
        stiffness.set_ylabel("error of Keff, %")
        stiffness.set_xlabel("cart at the window's centre, m")
        magnitude.legend()
    return figure


STUDY = Study("motion", "An axis in motion, corrected", PAPER, measure, draw)
