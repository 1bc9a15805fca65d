"""Fig. 12: the effect of a longer window, and the best window for a speed and a noise."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from livebode.simulation import BeltAxis, ClosedLoop, Strokes
from studies.common import (
    EXCITATION,
    RATE_HZ,
    SIGMA,
    STROKE,
    Floats,
    Local,
    Recording,
    decibels,
    error_db,
    lines,
    rms,
    stroke,
    track,
    within_stroke,
)
from studies.drawing import LIGHT, figure_of
from studies.fig10 import offline
from studies.result import Result, Study, Table, Verdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WINDOWS_MS = (50, 100, 150, 200, 300, 400, 600, 800)
SPEEDS, SIGMAS = (0.1, 0.2, STROKE.speed_m_per_s), (0.05, 0.1, 0.2, 0.4)
CROSSES_M = (0.35, 0.5, 0.7, 0.9, 1.15, 1.4)
# The same way for every window and speed: beyond the acceleration, and the longest window's centre lies within.
PART_M = (0.5, 1.4)
SHOWN_HZ = 60.0
PAPER = (
    "N = 50, 100 and 200 at 1 ms, and an offline response at six positions: compromise between noise and lag as N "
    "grows."
)


def samples(window_ms: float) -> int:
    return round(window_ms * RATE_HZ / 1000)


def at_speed(speed_m_per_s: float, sigma: float, seed: int = 0) -> Recording:
    motion = Strokes(start_m=0.25, end_m=1.6, speed_m_per_s=speed_m_per_s, dwell_s=STROKE.dwell_s)
    return stroke(sigma=sigma, seed=seed, motion=motion)


def error(recording: Recording, window_ms: float, truth: Local, newest: bool = False) -> float:
    """Rms over all lines in dB, for windows whose centre lies on the common part of the way."""
    found = within_stroke(track(recording.block, samples(window_ms)), recording)
    at = recording.block["x"][found.sample] if newest else found.schedule
    chosen = (found.schedule >= PART_M[0]) & (found.schedule <= PART_M[1])
    return float(rms(error_db(found, truth(at))[chosen]))


def noise_db(window_ms: float, sigma: float, truth: Local) -> float:
    """The same of noise alone, predicted: sigma² = N·σ²/|U|², and U from the loop; no simulation."""
    window, f = samples(window_ms), lines().frequency_hz
    axis = BeltAxis()
    w = np.abs(np.fft.rfft(np.resize(EXCITATION, window))[np.rint(f * window / RATE_HZ).astype(int)])
    found = []
    for x in np.linspace(*PART_M, 10):
        _, per_w = ClosedLoop(axis.linear(float(x)), axis.drive).responses(f)
        relative = np.sqrt(window) * sigma / (np.abs(per_w) * w * np.abs(truth(np.array([x]))[0]))
        found.append(decibels(np.e) * relative / np.sqrt(2))  # of |G|: one of the two components
    return float(rms(np.array(found)))


def bias_law(bias_db: Floats) -> tuple[float, float]:
    """a, b of bias² = (a·v)² + (b·(v·T)²)²: the resonance's memory, odd in speed, and the averaging over the window."""
    v, t = STROKE.speed_m_per_s, np.array(WINDOWS_MS) / 1000
    terms = np.column_stack([np.full(t.shape, v**2), (v * t) ** 4]) / bias_db[:, None] ** 2
    from scipy.optimize import nnls

    a2, b2 = nnls(terms, np.ones(t.shape))[0]
    return float(np.sqrt(a2)), float(np.sqrt(b2))


def best_windows(law: tuple[float, float], truth: Local, short: bool) -> tuple[Table, list[tuple[float, float]]]:
    """The window that the law and the noise's formula choose, and what it loses against the simulation's best."""
    rows, losses = [], []
    for v in SPEEDS[2:] if short else SPEEDS:
        for sigma in SIGMAS[1:2] if short else SIGMAS:
            predicted = [
                float(np.hypot(np.hypot(law[0] * v, law[1] * (v * t / 1000) ** 2), noise_db(t, sigma, truth)))
                for t in WINDOWS_MS
            ]
            recording = at_speed(v, sigma, seed=1)
            found = [error(recording, t, truth) for t in WINDOWS_MS]
            chosen, best = int(np.argmin(predicted)), int(np.argmin(found))
            loss = found[chosen] / found[best]
            losses.append((loss, predicted[chosen] / found[chosen]))
            rows.append((v, sigma, WINDOWS_MS[chosen], predicted[chosen], WINDOWS_MS[best], found[best], found[chosen]))
    header = (
        *("speed, m/s", "noise, rad/s", "window selected, ms", "predicted error, dB"),
        *("best in simulation, ms", "its error, dB", "error of the selected window, dB"),
    )
    return Table("Best window by prediction, and by simulation", header, rows), losses


def measure(short: bool = False) -> Result:
    truth = Local()
    quiet, noisy = at_speed(STROKE.speed_m_per_s, 0.0), at_speed(STROKE.speed_m_per_s, SIGMA)
    curves = {
        "bias, no noise": [error(quiet, t, truth) for t in WINDOWS_MS],
        "noise, predicted": [noise_db(t, SIGMA, truth) for t in WINDOWS_MS],
        "total, dated at the centre": [error(noisy, t, truth) for t in WINDOWS_MS],
        "total, dated at the newest sample": [error(noisy, t, truth, newest=True) for t in WINDOWS_MS],
    }
    law = bias_law(np.array(curves["bias, no noise"]))
    rows = [(t, *(values[i] for values in curves.values())) for i, t in enumerate(WINDOWS_MS)]
    part = f"{PART_M[0]:g} … {PART_M[1]:g} m"
    caption = f"Error of \\|G\\| over {part}, all lines, {STROKE.speed_m_per_s:g} m/s, noise {SIGMA:g} rad/s, rms in dB"
    best, losses = best_windows(law, truth, short)
    at = list(lines().frequency_hz).index(SHOWN_HZ)
    crosses = [decibels(offline(x).response(lines().frequency_hz)) for x in CROSSES_M]
    positions = np.array(CROSSES_M)
    found_at = (f"{x:g} m" for x in CROSSES_M)
    apart = np.array(crosses) - decibels(truth(positions))
    of_crosses = Table(
        "Offline estimates at standstill (crosses), error of \\|G\\|, rms over the lines in dB",
        tuple(found_at),
        [tuple(rms(apart, axis=1))],
    )
    worst = max(loss for loss, _ in losses)
    why = f"the law (a = {law[0]:.3g}, b = {law[1]:.3g}) predicts errors {min(f for _, f in losses):.2g} … "
    why += f"{max(f for _, f in losses):.2g} times those measured"
    verdicts = [Verdict("error of the window selected by prediction over that of the best window", worst, 1.1, why=why)]
    drawn = {"errors": curves, "record": noisy, "truth": truth, "crosses": np.array(crosses)[:, at], "law": law}
    return Result([Table(caption, ("window, ms", *curves), rows), best, of_crosses], verdicts, drawn)


def draw(result: Result) -> Figure:
    facts = f"two masses, {STROKE.speed_m_per_s} m/s, noise 0.1 rad/s; left: the {SHOWN_HZ:g} Hz line, dashed: truth"
    with figure_of("Fig. 12: what a longer window gains and costs", facts, (11.0, 5.0)) as figure:
        left, right = figure.subplots(1, 2)
        _along(left, result)
        for i, (name, values) in enumerate(result.curves["errors"].items()):
            right.loglog(WINDOWS_MS, values, "o-", color=LIGHT.traces[i], linewidth=1.3, markersize=4, label=name)
        right.set_xticks(WINDOWS_MS, [str(t) for t in WINDOWS_MS])
        right.yaxis.set_major_formatter("{x:g}")
        right.minorticks_off()
        right.set_xlabel("window, ms")
        right.set_ylabel("error of |G|, rms over lines, dB")
        right.legend(loc="upper left")
    return figure


def _along(axes: Axes, result: Result) -> None:
    record, at = result.curves["record"], list(lines().frequency_hz).index(SHOWN_HZ)
    for colour, t in zip(LIGHT.traces, (50, 100, 200)):
        found = within_stroke(track(record.block, samples(t)), record)
        newest = record.block["x"][found.sample]
        axes.plot(newest, found.magnitude_db[:, at], color=colour, linewidth=1.1, label=f"{t} ms, newest sample")
    position_m = np.linspace(0.26, 1.59, 200)
    axes.plot(position_m, decibels(result.curves["truth"](position_m))[:, at], color=LIGHT.ink, linewidth=0.9,
              dashes=(4, 2))  # fmt: skip
    axes.plot(CROSSES_M, result.curves["crosses"], "x", color=LIGHT.ink, markersize=8, markeredgewidth=1.8,
              label="offline, chirp at standstill")  # fmt: skip
    axes.set_ylim(-32, 17)
    axes.set_xlabel("cart position, m")
    axes.set_ylabel("|G|, dB of 1 rad/s per N m")
    axes.legend(loc="lower right")


STUDY = Study("fig12", "Fig. 12: the window", PAPER, measure, draw)
