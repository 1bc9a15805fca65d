"""Noise, even and odd distortion of the axis with and without friction, at standstill and slowly; Schroeder phases."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from livebode import Block
from livebode.simulation import BeltAxis, Friction, Mechanics, Motion, Sensor, SimulatedAxis, Standstill, Strokes
from studies.common import RATE_HZ, SIGMA, Floats, decibels, rms
from studies.drawing import LIGHT, figure_of
from studies.levels import (
    CHANCE,
    HIGHEST_HZ,
    LOWEST_HZ,
    PERIOD,
    PERIODS,
    RMS_N_M,
    Levels,
    odd_multisine_lines,
    period_of,
    rest,
)
from studies.result import Result, Study, Table, Verdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BANDS_HZ = ((LOWEST_HZ, 20), (20, 40), (40, 60), (60, 80), (80, HIGHEST_HZ))
POSITION_M = 0.8
LEAD = PERIOD  # samples of each record before the first period, for a motion's start to ring out
FRICTION = Friction(load_coulomb_n=15.0, load_stribeck_n=10.0)
FROZEN = Mechanics(frozen_position_m=POSITION_M)
PAPER = (
    "Schroeder phases keep the peaks low. Because they are fixed, they are less suitable for the detection of "
    "nonlinearity than random phases. Friction near standstill is named as a weakness. The levels are ours."
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
STANDSTILL = Case("friction", friction=FRICTION)
SLOW = Case("friction, 0.05 m/s, frozen springs", passing(0.05), FROZEN, FRICTION)
SCHROEDER = Case("friction, Schroeder", friction=FRICTION, schroeder=True)
CASES = (
    EXACT,
    LINEAR,
    Case("no friction, no noise", sigma=0.0),
    SMOOTH,
    Case("friction, no noise", friction=FRICTION, sigma=0.0),
    STANDSTILL,
    SCHROEDER,
    Case("friction, 0.02 m/s, frozen springs", passing(0.02), FROZEN, FRICTION),
    SLOW,
    Case("friction, 0.1 m/s, frozen springs", passing(0.1), FROZEN, FRICTION),
    Case("no friction, 0.02 m/s", passing(0.02)),
)


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


def measure(short: bool = False) -> Result:
    realisations = 2 if short else 12
    judged_or_shown = (EXACT, LINEAR, SMOOTH, STANDSTILL, SCHROEDER, SLOW)
    found = {case: levels(case, realisations) for case in (judged_or_shown if short else CASES)}
    truth = BeltAxis().linear(POSITION_M).sampled(RATE_HZ).response(odd_multisine_lines().frequency_hz)
    best = found[STANDSTILL].response.mean(axis=0)
    rows, of_bands = [], []
    for case, each in found.items():
        whole = each.within((LOWEST_HZ, HIGHEST_HZ))
        off, apart = (float(rms(decibels(each.response / against))) for against in (truth, best))
        rows.append((case.name, each.crest, *whole.values(), off, apart if case in (STANDSTILL, SCHROEDER) else ""))
        if case in (SMOOTH, STANDSTILL, SCHROEDER, SLOW):
            of_bands += [(case.name, f"{a} … {b}", *each.within((a, b)).values()) for a, b in BANDS_HZ]
    header = (
        *("case", "crest factor", "noise, dB", "even, dB", "odd, dB"),
        *("\\|G\\| relative to the linear machine, rms dB", "one run relative to the mean of all phases, rms dB"),
    )
    caption = (
        f"At {POSITION_M} m, {realisations} phase realisations of {PERIODS} periods of 1 s: levels relative to the "
        "output at the excited lines; the noise is that of the mean over the periods, and the other two contain it"
    )
    bands = Table("The same by band", ("case", "band, Hz", "noise, dB", "even, dB", "odd, dB"), of_bands)
    return Result([Table(caption, header, rows), bands], judged(found), {"found": found})


def judged(found: dict[Case, Levels]) -> list[Verdict]:
    whole = {case: each.within((LOWEST_HZ, HIGHEST_HZ)) for case, each in found.items()}
    verdicts = [
        Verdict(f"{EXACT.name}: {kind}, dB", whole[EXACT][kind], -200.0, why="the periodic state is not reached")
        for kind in ("even", "odd")
    ]
    for kind in ("even", "odd"):
        ratio, most = found[LINEAR].above_noise(getattr(found[LINEAR], kind))
        claim = f"{LINEAR.name}: power at the {kind} detection lines over that of the noise"
        verdicts.append(Verdict(claim, ratio, most, why=f"chance exceeds it once in {1 / CHANCE:g}"))
    at_standstill = whole[STANDSTILL]
    margin = at_standstill["odd"] - at_standstill["even"]
    why = "the springs, which follow the cart, are even"
    verdicts.append(Verdict(f"{STANDSTILL.name}, standstill: odd above even, dB", margin, 20.0, at_least=True, why=why))
    ratio, least = found[STANDSTILL].above_noise(found[STANDSTILL].odd)
    claim = f"{STANDSTILL.name}, standstill: power at the odd detection lines over that of the noise"
    verdicts.append(Verdict(claim, ratio, least, at_least=True, why="the friction is not detected"))
    quiet_odd = rms(np.abs(found[STANDSTILL].mean[:, found[STANDSTILL].odd]))
    apart = abs(float(decibels(np.array(found[STANDSTILL].spread() / quiet_odd))))
    here, there = whole[SCHROEDER]["odd"], at_standstill["odd"]
    why = "with the phases of one signal, the distortion at each line does not average"
    claim = f"{SCHROEDER.name}, standstill: odd level, difference from that with random phases, dB"
    verdicts.append(Verdict(claim, abs(here - there), 3.0, why=why))
    claim = "friction: spread of the excited lines over the phases, difference from the odd detection lines, dB"
    verdicts.append(
        Verdict(claim, apart, 3.0, why="the detection lines do not show the distortion at the excited lines")
    )
    return verdicts


def draw(result: Result) -> Figure:
    facts = (
        f"cart at {POSITION_M} m, odd multisine of {RMS_N_M} N m rms, {PERIODS} periods of 1 s, noise {SIGMA} rad/s; "
    )
    facts += "feedback's share taken off; rms over the phase realisations"
    with figure_of("Noise, even and odd distortion of the velocity", facts, (11.0, 7.4)) as figure:
        panels = figure.subplots(2, 2, sharex=True, sharey=True)
        for axes, case in zip(panels.flat, (SMOOTH, STANDSTILL, SLOW, SCHROEDER)):
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
    axes.plot(f[found.odd], rest_db[found.odd], "^", color=LIGHT.traces[6], markersize=5, label="odd detection lines")
    axes.plot(
        f[found.even], rest_db[found.even], "o", color=LIGHT.traces[0], markersize=3, label="even detection lines"
    )
    noise = decibels(np.sqrt(found.noise.mean(axis=0) / PERIODS))
    axes.plot(f, noise, color=LIGHT.muted, linewidth=0.9, label="noise, from the scatter between periods")


STUDY = Study("nonlinearity", "Noise, even and odd distortion", PAPER, measure, draw)
