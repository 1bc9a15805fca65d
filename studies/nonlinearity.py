"""Noise, even and odd distortion: an odd random-phase multisine with quiet lines, and Schroeder's beside it.

The odd-odd multisine with random quiet lines and its robust method (many phase realisations, several periods each) are
those of Pintelon and Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., Wiley 2012, chapter 4.
Feedback carries every distortion into u, and so into y again; to first order Y − Ĝ·U takes that out, with Ĝ the joint
estimate at the excited lines (on feedback and quiet lines: Pintelon, Louarroudi and Lataire, Detecting and Quantifying
the Nonlinear and Time-Variant Effects in FRF Measurements Using Periodic Excitations).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import f as fisher

from livebode import Block, Lines, multisine
from livebode.simulation import BeltAxis, Friction, Mechanics, Motion, Sensor, SimulatedAxis, Standstill, Strokes
from studies.common import RATE_HZ, SIGMA, Complex, Floats, decibels, rms
from studies.drawing import LIGHT, figure_of
from studies.result import Result, Study, Table, Verdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PERIOD = 4000  # samples: lines 1 Hz apart
PERIODS = 8  # of each phase realisation
HIGHEST_HZ = 160
GROUP = 4  # odd lines of which one, at random, is quiet
RMS_N_M = 1.87  # of the whole: that of seven lines of 1 N m
BANDS_HZ = ((3, 20), (20, 40), (40, 60), (60, 80), (80, HIGHEST_HZ))
POSITION_M = 0.8
LEAD = PERIOD  # samples of each record before the first period, for a motion's start to ring out
FRICTION = Friction(load_coulomb_n=15.0, load_stribeck_n=10.0)
FROZEN = Mechanics(frozen_position_m=POSITION_M)
CHANCE = 1e-3  # of a verdict about noise to be missed for no reason
PAPER = (
    "Schroeder phases keep the peaks low; being fixed, they serve the detection of nonlinearity less well than random "
    "ones. Friction near standstill is named as a weakness. The levels are ours."
)


@dataclass(frozen=True)
class Case:
    """A machine, its motion, its noise, and the phases."""

    name: str
    motion: Motion = field(default_factory=lambda: Standstill(position_m=POSITION_M))
    mechanics: Mechanics = field(default_factory=Mechanics)
    friction: Friction = field(default_factory=Friction)
    sigma: float = SIGMA
    schroeder: bool = False


def passing(speed_m_per_s: float) -> Strokes:
    """A stroke whose measured periods have their middle at POSITION_M."""
    ahead = speed_m_per_s * (LEAD + PERIODS * PERIOD / 2) / RATE_HZ
    return Strokes(start_m=POSITION_M - ahead, end_m=POSITION_M + ahead, speed_m_per_s=speed_m_per_s, dwell_s=0.0)


EXACT = Case("frozen springs, no friction, no noise", mechanics=FROZEN, sigma=0.0)
LINEAR = Case("frozen springs, no friction", mechanics=FROZEN)
SMOOTH = Case("no friction")
STANDING = Case("friction", friction=FRICTION)
SLOW = Case("friction, 0.05 m/s, frozen springs", passing(0.05), FROZEN, FRICTION)
SCHROEDER = Case("friction, Schroeder", friction=FRICTION, schroeder=True)
CASES = (
    EXACT,
    LINEAR,
    Case("no friction, no noise", sigma=0.0),
    SMOOTH,
    Case("friction, no noise", friction=FRICTION, sigma=0.0),
    STANDING,
    SCHROEDER,
    Case("friction, 0.02 m/s, frozen springs", passing(0.02), FROZEN, FRICTION),
    SLOW,
    Case("friction, 0.1 m/s, frozen springs", passing(0.1), FROZEN, FRICTION),
    Case("no friction, 0.02 m/s", passing(0.02)),
)


def odd_multisine_lines(seed: int = 0) -> Lines:
    """Odd lines, less one of every GROUP at random; quiet are those and the even ones between."""
    odd = np.arange(BANDS_HZ[0][0], HIGHEST_HZ, 2)
    generator = np.random.default_rng(seed)
    # The outermost stay excited, so that Ĝ is never extrapolated.
    left_out = {int(generator.choice(group)) for group in np.array_split(odd[1:-1], len(odd) // GROUP)}
    bins = tuple(int(k) for k in odd if k not in left_out)
    return Lines(bins, PERIOD, RATE_HZ, tuple(k for k in range(bins[0], bins[-1]) if k not in bins))


def period_of(lines: Lines, seed: int | None) -> Floats:
    """One period of equal lines; None for Schroeder phases."""
    phases: Any = "schroeder" if seed is None else np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines))
    return multisine(lines, RMS_N_M * np.sqrt(2 / len(lines)), phases)


@dataclass(frozen=True)
class Levels:
    """Amplitudes at the bins 1 Hz apart, from several phase realisations of one case.

    `response` (realisations, excited) is Ĝ; of the rest Y − Ĝ·U `mean` (realisations, bins) is over the periods, and
    `noise` (realisations, bins) the variance of a single period; `y`, `u` (realisations, excited) are their means.
    """

    lines: Lines
    response: Complex
    mean: Complex
    noise: Floats
    y: Complex
    u: Complex
    crest: float

    @property
    def bins(self) -> Floats:
        return np.arange(self.lines.bins[0], self.lines.bins[-1] + 1)

    @property
    def even(self) -> Any:
        return self.bins % 2 == 0

    @property
    def odd(self) -> Any:
        """The quiet ones."""
        return ~self.even & ~np.isin(self.bins, self.lines.bins)

    def within(self, band_hz: tuple[float, float]) -> dict[str, float]:
        """Noise of the mean over the periods, and both distortions, in dB of the response's output in the band."""
        inside = (self.bins >= band_hz[0]) & (self.bins < band_hz[1])
        f = self.lines.frequency_hz
        output = rms(np.abs(self.y[:, (f >= band_hz[0]) & (f < band_hz[1])]))
        return {
            "noise": float(decibels(np.sqrt(np.mean(self.noise[:, inside]) / PERIODS) / output)),
            "even": float(decibels(rms(np.abs(self.mean[:, inside & self.even])) / output)),
            "odd": float(decibels(rms(np.abs(self.mean[:, inside & self.odd])) / output)),
        }

    def above_noise(self, which: Any) -> tuple[float, float]:
        """Power of the mean rest at these bins over that of noise alone, and what chance does not exceed."""
        ratio = PERIODS * np.mean(np.abs(self.mean[:, which]) ** 2) / np.mean(self.noise[:, which])
        values = 2 * self.mean[:, which].size
        return float(ratio), float(fisher.isf(CHANCE, values, values * (PERIODS - 1)))

    def spread(self) -> float:
        """Rms of the output at the excited lines that changes with the phases."""
        off = (self.response - self.response.mean(axis=0)) * self.u
        return float(rms(np.abs(off)) * np.sqrt(len(off) / (len(off) - 1)))


def levels(case: Case, realisations: int) -> Levels:
    lines = odd_multisine_lines()
    seeds: list[int | None] = [None] if case.schroeder else list(range(realisations))
    periods = [period_of(lines, seed) for seed in seeds]
    each = [rest(record(case, period, seed or 0), lines) for period, seed in zip(periods, seeds)]
    crest = np.mean([np.max(np.abs(period)) / RMS_N_M for period in periods])
    return Levels(lines, *(np.array(part) for part in zip(*each)), crest=float(crest))


def record(case: Case, period: Floats, seed: int) -> Block:
    """Whole periods."""
    axis = BeltAxis(
        mechanics=case.mechanics,
        friction=case.friction,
        motion=case.motion,
        sensor=Sensor(noise_rad_per_s=case.sigma),
        excitation_n_m=period,
        seconds=(LEAD + PERIODS * PERIOD) / RATE_HZ,
        run_in_s=20.0,
        seed=seed,
    )
    block, _ = SimulatedAxis(axis).run()
    return block.cut(LEAD, len(block))


def rest(block: Block, lines: Lines) -> tuple[Complex, Complex, Floats, Complex, Complex]:
    """Of one realisation: Ĝ, mean and variance of Y − Ĝ·U at all bins, and the means of Y and U at the excited ones."""
    y, u = (np.fft.rfft(block[name].reshape(-1, PERIOD), axis=1) * (2 / PERIOD) for name in ("velocity", "u"))
    at = np.asarray(lines.bins)
    every = np.arange(at[0], at[-1] + 1)
    response = y[:, at].mean(axis=0) / u[:, at].mean(axis=0)
    between = np.interp(every, at, response.real) + 1j * np.interp(every, at, response.imag)
    left = y[:, every] - between * u[:, every]
    return response, left.mean(axis=0), left.var(axis=0, ddof=1), y[:, at].mean(axis=0), u[:, at].mean(axis=0)


def measure(short: bool = False) -> Result:
    realisations = 2 if short else 12
    judged_or_shown = (EXACT, LINEAR, SMOOTH, STANDING, SCHROEDER, SLOW)
    found = {case: levels(case, realisations) for case in (judged_or_shown if short else CASES)}
    truth = BeltAxis().linear(POSITION_M).sampled(RATE_HZ).response(odd_multisine_lines().frequency_hz)
    best = found[STANDING].response.mean(axis=0)
    rows, of_bands = [], []
    for case, each in found.items():
        whole = each.within((BANDS_HZ[0][0], HIGHEST_HZ))
        off, apart = (float(rms(decibels(each.response / against))) for against in (truth, best))
        rows.append((case.name, each.crest, *whole.values(), off, apart if case in (STANDING, SCHROEDER) else ""))
        if case in (SMOOTH, STANDING, SCHROEDER, SLOW):
            of_bands += [(case.name, f"{a} … {b}", *each.within((a, b)).values()) for a, b in BANDS_HZ]
    header = ("case", "crest factor", "noise, dB", "even, dB", "odd, dB", "\\|G\\| against the linear machine, rms dB",
              "one run against the mean of all phases, rms dB")  # fmt: skip
    caption = (
        f"At {POSITION_M} m, {realisations} phase realisations of {PERIODS} periods of 1 s: levels against the output "
        "at the excited lines; noise is that of the mean over the periods, and is in the other two"
    )
    bands = Table("The same by band", ("case", "band, Hz", "noise, dB", "even, dB", "odd, dB"), of_bands)
    return Result([Table(caption, header, rows), bands], judged(found), {"found": found})


def judged(found: dict[Case, Levels]) -> list[Verdict]:
    whole = {case: each.within((BANDS_HZ[0][0], HIGHEST_HZ)) for case, each in found.items()}
    verdicts = [
        Verdict(f"{EXACT.name}: {kind}, dB", whole[EXACT][kind], -200.0, why="the periodic state is not reached")
        for kind in ("even", "odd")
    ]
    for kind in ("even", "odd"):
        ratio, most = found[LINEAR].above_noise(getattr(found[LINEAR], kind))
        claim = f"{LINEAR.name}: power at the quiet {kind} lines over that of the noise"
        verdicts.append(Verdict(claim, ratio, most, why=f"chance exceeds it once in {1 / CHANCE:g}"))
    standing = whole[STANDING]
    margin = standing["odd"] - standing["even"]
    why = "the springs, which follow the cart, are even"
    verdicts.append(Verdict(f"{STANDING.name}, standstill: odd above even, dB", margin, 20.0, at_least=True, why=why))
    ratio, least = found[STANDING].above_noise(found[STANDING].odd)
    claim = f"{STANDING.name}, standstill: power at the quiet odd lines over that of the noise"
    verdicts.append(Verdict(claim, ratio, least, at_least=True, why="the friction is not seen"))
    quiet_odd = rms(np.abs(found[STANDING].mean[:, found[STANDING].odd]))
    apart = abs(float(decibels(np.array(found[STANDING].spread() / quiet_odd))))
    here, there = whole[SCHROEDER]["odd"], standing["odd"]
    why = "with the phases of one signal, what falls on each line does not average"
    claim = f"{SCHROEDER.name}, standstill: odd level against that of random phases, dB apart"
    verdicts.append(Verdict(claim, abs(here - there), 3.0, why=why))
    claim = "friction: spread of the excited lines over the phases against the level at the quiet odd ones, dB apart"
    verdicts.append(Verdict(claim, apart, 3.0, why="what the quiet lines show is not what the excited ones suffer"))
    return verdicts


def draw(result: Result) -> Figure:
    facts = (
        f"cart at {POSITION_M} m, odd multisine of {RMS_N_M} N m rms, {PERIODS} periods of 1 s, noise {SIGMA} rad/s; "
    )
    facts += "feedback's share taken off; rms over the phase realisations"
    with figure_of("Noise, even and odd distortion of the velocity", facts, (11.0, 7.4)) as figure:
        panels = figure.subplots(2, 2, sharex=True, sharey=True)
        for axes, case in zip(panels.flat, (SMOOTH, STANDING, SLOW, SCHROEDER)):
            _spectrum(axes, result.curves["found"][case])
            axes.set_title(case.name + ("" if case is SLOW else ", standstill"), size=10, loc="left")
        for axes in panels[1]:
            axes.set_xlabel("frequency, Hz")
        for axes in panels[:, 0]:
            axes.set_ylabel("amplitude, dB of 1 rad/s")
        figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="upper right", ncols=2)
    return figure


def _spectrum(axes: Axes, found: Levels) -> None:
    f, rest_db = found.bins, decibels(rms(np.abs(found.mean), axis=0))
    axes.plot(found.lines.frequency_hz, decibels(rms(np.abs(found.y), axis=0)), ".", color=LIGHT.ink, markersize=4,
              label="response at the excited lines")  # fmt: skip
    axes.plot(f[found.odd], rest_db[found.odd], "^", color=LIGHT.traces[6], markersize=5, label="quiet odd lines")
    axes.plot(f[found.even], rest_db[found.even], "o", color=LIGHT.traces[0], markersize=3, label="quiet even lines")
    noise = decibels(np.sqrt(found.noise.mean(axis=0) / PERIODS))
    axes.plot(f, noise, color=LIGHT.muted, linewidth=0.9, label="noise, from the scatter between periods")


STUDY = Study("nonlinearity", "Noise, even and odd distortion", PAPER, measure, draw)
