"""Fig. 10: the response at standstill, online with bounds and offline by a chirp; errors of the loop description."""

from __future__ import annotations

from functools import cache
from math import expm1
from typing import TYPE_CHECKING

import numpy as np
from scipy.signal import chirp

from examples.loop_costs import LOOPS
from livebode import Block, Response, welch
from livebode.simulation import BeltAxis, BeltResponse, Mechanics, Sensor, SimulatedAxis, Standstill
from studies.common import EXCITATION, RATE_HZ, RUN_IN_S, SIGMA, WINDOW, Complex, Floats, decibels, lines, rms, track
from studies.drawing import LIGHT, figure_of
from studies.result import Result, Study, Table, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POSITION_M = 0.8
SECONDS = 5.0
THREE_SIGMA = 2.43  # the c at which a bound of a complex number promises 99.7 %
PROMISES = {1.0: -expm1(-1.0), 2.0: -expm1(-4.0), THREE_SIGMA: -expm1(-(THREE_SIGMA**2))}
BAND_HZ = (10.0, 150.0)
PAPER = (
    "At standstill at 0.8 m: online estimates with 3σ bars, and an offline response by chirp and (2) with coherence; "
    "both compared with (14)."
)


def belt(position_m: float = POSITION_M) -> BeltResponse:
    """Equation (14) at a position."""
    m = Mechanics()
    stiffness, damping = float(m.stiffness_at(position_m)), float(m.damping_at(position_m))
    return BeltResponse(m.inertia_kg_m2, m.load_kg, m.radius_m, stiffness, damping)


def sampled(frequency_hz: Floats, position_m: float = POSITION_M) -> Complex:
    """The exact response at the ticks, behind the hold."""
    return BeltAxis().linear(position_m).sampled(RATE_HZ).response(frequency_hz)


def at_standstill(excitation: Floats, seconds: float, seed: int, sigma: float = SIGMA, **options: object) -> Block:
    options = {"motion": Standstill(position_m=POSITION_M), "mechanics": Mechanics()} | options
    sensor = Sensor(noise_rad_per_s=sigma)
    axis = BeltAxis(sensor=sensor, excitation_n_m=excitation, seconds=seconds, seed=seed, **options)
    return SimulatedAxis(axis).run()[0]


def offline(position_m: float = POSITION_M, seed: int = 0) -> Response:
    """The paper's chirp, 5 … 250 Hz in 5 s, 2 N m; (2) from segments of 1 s."""
    ticks = int(SECONDS * RATE_HZ)
    sweep = 2.0 * chirp(np.arange(ticks) / RATE_HZ, 5.0, SECONDS, 250.0)
    block = at_standstill(sweep, SECONDS, seed, motion=Standstill(position_m=position_m))
    return welch(block["w"], block["u"], block["velocity"], fs=RATE_HZ, window=int(RATE_HZ), overlap=0.75)


def online(runs: int, mechanics: Mechanics | None = None) -> list[Response]:
    """The average over each of many stretches of 5 s of one long standstill, after the loop has settled."""
    axis = BeltAxis(
        motion=Standstill(position_m=POSITION_M),
        mechanics=mechanics or Mechanics(),
        sensor=Sensor(noise_rad_per_s=SIGMA),
        excitation_n_m=EXCITATION,
        seconds=runs * SECONDS,
        run_in_s=RUN_IN_S,
    )
    stretches = SimulatedAxis(axis).blocks(block_samples=int(SECONDS * RATE_HZ))
    return [track(block, hop=WINDOW, average=True, forgetting=1.0)[-1] for block in stretches]


def coverage(found: list[Response]) -> list[Floats]:
    """Share of errors within each promised bound, %, by line."""
    truth = sampled(lines().frequency_hz)
    return [100 * np.mean([np.abs(r.value - truth) <= r.bound(c) for r in found], axis=0) for c in PROMISES]


def bias(found: list[Response]) -> Floats:
    """Size of the mean error over the mean sigma, by line."""
    error = np.mean([r.value for r in found], axis=0) - sampled(lines().frequency_hz)
    return np.abs(error) / np.mean([r.sigma for r in found], axis=0)


@cache
def periodic() -> Block:
    """Two periods of the linear machine, without noise, when it has settled to rounding."""
    frozen = Mechanics(frozen_position_m=POSITION_M)
    return at_standstill(EXCITATION, 3 * WINDOW / RATE_HZ, 0, sigma=0.0, mechanics=frozen, run_in_s=2 * RUN_IN_S)


def exactness() -> dict[str, float]:
    """Largest relative error of the plant in the periodic state, for joint and each description of the loop."""
    truth = sampled(lines().frequency_hz)
    found = {"joint": track(periodic())[-1].value}
    for name, loop in LOOPS.items():
        found[f"indirect, {name}"] = track(periodic(), estimator="indirect", loop=loop)[-1].value
    return {name: float(np.max(np.abs(value / truth - 1))) for name, value in found.items()}


def against_14(shown: dict[str, Response]) -> Table:
    rows = []
    for name, response in shown.items():
        at = in_band(response)
        f = response.lines.frequency_hz[at]
        off_14, off = response.value[at] / belt().response(f), response.value[at] / sampled(f)
        rows.append((name, float(rms(decibels(off_14))), float(rms(decibels(off))), float(np.max(np.abs(off - 1)))))
    header = (
        "estimate",
        "difference from (14), rms dB",
        "difference from the sampled plant, rms dB",
        "largest relative error",
    )
    return Table(f"\\|G\\| over {BAND_HZ[0]:g} … {BAND_HZ[1]:g} Hz, one run", header, rows)


def in_band(response: Response) -> Floats:
    f = response.lines.frequency_hz
    return response.valid & (f >= BAND_HZ[0]) & (f <= BAND_HZ[1])


def measure(short: bool = False) -> Result:
    runs = 12 if short else 400
    machines = {"the axis": online(runs), "linear": online(runs, Mechanics(frozen_position_m=POSITION_M))}
    exact = exactness()
    shown = {"online, multisine, 5 s": machines["the axis"][0], "offline, chirp, 5 s": offline()}
    costs = Table(
        "Periodic state, no noise: largest relative error of the plant at any line",
        ("estimator and description of the loop", "error"),
        [(name, f"{error:.1e}") for name, error in exact.items()],
    )
    verdicts = [
        *bound_verdicts(machines),
        Verdict("joint, periodic and without noise, relative error", exact["joint"], 1e-9),
        Verdict("indirect, periodic and without noise, relative error", exact["indirect, as it is"], 1e-5),
    ]
    return Result([coverage_table(machines), against_14(shown), costs], verdicts, {"shown": shown})


def coverage_table(machines: dict[str, list[Response]]) -> Table:
    rows: list[tuple[object, ...]] = []
    for name, found in machines.items():
        for c, promise, inside in zip(PROMISES, PROMISES.values(), coverage(found)):
            rows.append((f"{name}, c = {c:g}", 100 * promise, float(np.mean(inside)), *inside))
        rows.append((f"{name}, mean error over sigma", "", "", *bias(found)))
    header = ("machine, bound", "nominal, %", "measured, %", *(f"{f:g} Hz" for f in lines().frequency_hz))
    runs = len(machines["linear"])
    return Table(f"Share of {runs} stretches of 5 s whose error lies within the bound, %", header, rows)


def bound_verdicts(machines: dict[str, list[Response]]) -> list[Verdict]:
    """Each promise over all lines; two standard errors of the count are left to chance."""
    verdicts = []
    for name, found in machines.items():
        most = bias(found)
        at = lines().frequency_hz[np.argmax(most)]
        for (c, p), inside in zip(PROMISES.items(), coverage(found)):
            least = 100 * (p - 2 * np.sqrt(p * (1 - p) / (len(found) * len(inside))))
            claim = f"{name}: errors within c = {c:g}, %, nominal {100 * p:.1f} less two standard errors"
            why = f"the mean error is {most.max():.2g} sigma at {at:g} Hz, which averaging does not reduce"
            if name != "linear":
                why += "; the vibration of the axis modulates its stiffness (compare the linear machine)"
            verdicts.append(Verdict(claim, float(np.mean(inside)), float(least), at_least=True, why=why))
    return verdicts


def draw(result: Result) -> Figure:
    facts = "two masses, noise 0.1 rad/s; online: 5 s of multisine, bars: 3σ; offline: chirp 5 … 250 Hz, 5 s, 2 N m"
    with figure_of("Fig. 10: the response at standstill, cart at 0.8 m", facts, (9.0, 8.0)) as figure:
        magnitude, error, coherence = figure.subplots(3, 1, sharex=True, height_ratios=(2, 1.4, 1))
        f = np.geomspace(8, 250, 800)
        magnitude.semilogx(f, decibels(belt().response(f)), color=LIGHT.ink, linewidth=1.0, label="(14)")
        for colour, marker, (name, r) in zip(
            LIGHT.traces[1::-1], (".", "o"), list(result.curves["shown"].items())[::-1]
        ):
            at, truth = r.lines.frequency_hz, sampled(r.lines.frequency_hz)
            style = {"color": colour, "linestyle": "none", "marker": marker, "markersize": 3 if marker == "." else 5}
            bound = np.minimum(r.bound(THREE_SIGMA) / np.abs(r.value), 0.99)
            bars = np.abs(decibels(np.array([1 - bound, 1 + bound])))
            shown = (at >= 8) & (at <= 250)
            magnitude.plot(at[shown], r.magnitude_db[shown], label=name, **style)
            ours = bars[:, shown] if marker == "o" else None
            error.errorbar(at[shown], decibels(r.value / truth)[shown], yerr=ours, capsize=3, **style)
            coherence.plot(at[shown], r.coherence[shown], **style)
        magnitude.set_ylabel("|G|, dB of 1 rad/s per N m")
        magnitude.legend(loc="lower right")
        error.set_ylabel("error of |G|, dB")
        error.set_ylim(-1.5, 1.5)
        coherence.set_ylabel("coherence γ²")
        coherence.set_xlabel("frequency, Hz")
        coherence.set_xlim(8, 250)
        coherence.set_xticks([10, 20, 40, 60, 100, 200], ["10", "20", "40", "60", "100", "200"])
        coherence.minorticks_off()
    return figure


STUDY = Study("fig10", "Fig. 10: the response at standstill", PAPER, measure, draw)
