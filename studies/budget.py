"""The error budget: what part of the error of |G| along a stroke is noise, motion, transient or linearisation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from livebode.simulation import BeltAxis, Mechanics, Standstill, Strokes
from studies.common import (
    EXCITATION,
    RATE_HZ,
    RUN_IN_S,
    STROKE,
    WINDOW,
    Floats,
    Local,
    Recording,
    error_db,
    lines,
    rms,
    stroke,
    track,
    within_stroke,
)
from studies.drawing import LIGHT, figure_of
from studies.fig10 import at_standstill
from studies.result import Result, Study, Table, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

EDGES_M = np.linspace(0.25, 1.6, 28)  # a frozen machine stands for each of these 5 cm
BACKWARD = Strokes(start_m=1.6, end_m=0.25, speed_m_per_s=STROKE.speed_m_per_s, dwell_s=STROKE.dwell_s)
PARTS = ("noise", "motion, odd in speed", "motion, even in speed", "transient of the acceleration", "linearisation")
PAPER = "The choice of N is a compromise between noise and lag. The budget is ours."


def errors(recording: Recording, truth: Local, **options: object) -> tuple[Floats, Floats]:
    """In dB (rows, lines), and the position of each row."""
    found = within_stroke(track(recording.block, **options), recording)
    return error_db(found, truth(found.schedule)), found.schedule


def over_way(db: Floats, at_m: Floats, to_m: Floats) -> Floats:
    """The errors of a run over the way at other positions, line by line."""
    order = np.argsort(at_m)
    return np.column_stack([np.interp(to_m, at_m[order], line[order]) for line in db.T])


def transient(at_m: Floats, edges_m: Floats, **options: object) -> Floats:
    """The error that the acceleration leaves on a machine that does not change: at each place the machine frozen there.

    Shape (positions, lines).
    """
    found = np.zeros((len(at_m), len(lines())))
    place = np.clip(np.digitize(at_m, edges_m) - 1, 0, len(edges_m) - 2)
    for i in np.unique(place):
        mechanics = Mechanics(frozen_position_m=float(edges_m[i] + edges_m[i + 1]) / 2)
        truth = BeltAxis(mechanics=mechanics).linear(0.8).sampled(RATE_HZ).response(lines().frequency_hz)
        recording = stroke(sigma=0.0, mechanics=mechanics)
        responses = within_stroke(track(recording.block, **options), recording)
        db = error_db(responses, truth)
        found[place == i] = over_way(db, responses.schedule, at_m[place == i])
    return found


def linearisation(at_m: Floats, **options: object) -> Floats:
    """The error at standstill without noise, from the axis's own vibration; shape (positions, lines)."""
    positions_m = np.linspace(0.3, 1.55, 6)
    truth, db = Local()(positions_m), []
    for x, local in zip(positions_m, truth):
        still = Standstill(position_m=float(x))
        block = at_standstill(EXCITATION, 2 * WINDOW / RATE_HZ, 0, sigma=0.0, motion=still, run_in_s=RUN_IN_S)
        db.append(error_db(track(block, **options)[-1:], local))
    return over_way(np.concatenate(db), positions_m, at_m)


def budget(edges_m: Floats, **options: object) -> dict[str, Floats]:
    """Each part's error in dB at the rows of the forward stroke, shape (rows, lines), and `position_m`."""
    truth = Local()
    noisy, _ = errors(stroke(), truth, **options)
    forward, at_m = errors(stroke(sigma=0.0), truth, **options)
    noise = noisy[: len(forward)] - forward[: len(noisy)]
    backward = over_way(*errors(stroke(sigma=0.0, motion=BACKWARD), truth, **options), at_m)
    accelerating, bent = transient(at_m, edges_m, **options), linearisation(at_m, **options)
    moved = forward - accelerating - bent
    back = backward - bent  # its transient lies at the other end, and is left out of the steady part below
    odd, even = (moved - back) / 2, (moved + back) / 2
    return {"total": noisy, "position_m": at_m} | dict(zip(PARTS, (noise, odd, even, accelerating, bent)))


def measure(short: bool = False) -> Result:
    edges_m = EDGES_M[:: 9 if short else 1]
    ways = {"centre": budget(edges_m), "centre, Hann": budget(edges_m, hann=True)}
    verdicts, rows = [], []
    for way, parts in ways.items():
        at = parts["position_m"]
        chosen = (at > 0.45) & (at < 1.4)
        by_part = {name: float(rms(parts[name][chosen])) for name in PARTS}
        total, summed = float(rms(parts["total"][chosen])), float(np.sqrt(sum(e**2 for e in by_part.values())))
        whole = (float(rms(parts[name])) for name in ("total", "noise", PARTS[3], PARTS[4]))
        rows.append((way, total, *by_part.values(), summed, *whole))
        why = "the parts are not independent: " + ", ".join(f"{name} {e:.3g}" for name, e in by_part.items())
        verdicts.append(Verdict(f"{way}: root of the parts' sum of squares, difference from the total, %",
                                100 * abs(summed / total - 1), 10.0, why=why))  # fmt: skip
    header = ("dated at", "total", *PARTS, "root of the sum of squares", *(
        f"whole stroke: {name}" for name in ("total", "noise", "transient", "linearisation")))  # fmt: skip
    caption = "Error of \\|G\\|, rms over all lines in dB, cart from 0.45 to 1.4 m, and over the whole stroke"
    return Result([Table(caption, header, rows)], verdicts, {"ways": ways})


def draw(result: Result) -> Figure:
    facts = f"two masses, {STROKE.speed_m_per_s} m/s, window 100 ms, noise 0.1 rad/s; rms over lines in 3 cm of the way"
    with figure_of("Error budget: where the error of |G| comes from", facts, (11.0, 5.0)) as figure:
        edges_m = np.linspace(0.25, 1.6, 46)
        panels = figure.subplots(1, 2, sharey=True)
        for axes, (way, parts) in zip(panels, result.curves["ways"].items()):
            place = np.digitize(parts["position_m"], edges_m)
            seen = [i for i in range(1, len(edges_m)) if np.any(place == i)]
            middle = [(edges_m[i - 1] + edges_m[i]) / 2 for i in seen]
            for colour, name in zip((LIGHT.ink, *LIGHT.traces[:4], LIGHT.traces[6]), ("total", *PARTS)):
                values = [rms(parts[name][place == i]) for i in seen]
                axes.semilogy(middle, values, color=colour, linewidth=1.3, label=name)
            axes.set_title(f"dated at the {way}", size=10, loc="left")
            axes.set_xlabel("cart position, m")
            axes.yaxis.set_major_formatter("{x:g}")
        panels[0].set_ylabel("error of |G|, rms, dB")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="upper right", ncols=3)
    return figure


STUDY = Study("budget", "Error budget along a stroke", PAPER, measure, draw)
