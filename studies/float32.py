"""Fig. 8, 9 through the float32 kernel: the loss on a drive without double precision, with and without offsets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from livebode import Block
from studies import ways
from studies.common import (
    STROKE,
    WINDOW,
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
from studies.result import Result, Study, Table, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIGNALS = ("w", "u", "velocity")
OFFSETS = (0.0, 1.0, 10.0, 100.0, 1000.0, 10000.0)  # N m and rad/s, on all three at once
WAYS = {
    "window's centre": ways.centre,
    "the same with Hann": lambda recording, **o: ways.centre(recording, hann=True, **o),
    "the same differenced": lambda recording, **o: ways.centre(recording, differenced=SIGNALS, **o),
    "with the reference model": ways.by_model,
}
# A torque that is not the machine's moves the reference model away in float64, too; further up there is nothing to see.
OF_MODEL_MAX = 100.0
FINEST_DB = 0.15  # the smallest target of Fig. 8, 9
LIMITS_DB = {0.0: FINEST_DB / 100, 100.0: FINEST_DB / 10}  # by offset
PAPER = "The number format is not discussed. The study is ours: the target is a negligible difference."


def offset(recording: Recording, by: float) -> Recording:
    """The same stroke with a constant on each signal."""
    block = recording.block
    data = block.data.copy()
    data[[block.index(name) for name in SIGNALS]] += by
    return Recording(recording.axis, Block(data, block.channels, block.rate_hz), recording.first, recording.last)


@dataclass(frozen=True)
class NonOverlappingWindows:
    """One way through float32: |G| against float64 in dB (rows, lines), where, and the error of both in dB."""

    db: Floats
    position_m: Floats
    error_db: float
    error64_db: float

    @classmethod
    def of(cls, way: ways.Way, recording: Recording, truth: Local) -> NonOverlappingWindows:
        (single, at), (double, _) = way(recording, dtype="float32"), way(recording)
        errors = (float(rms(error_db(found, truth(at)))) for found in (single, double))
        return cls(decibels(single.value / double.value), at, *errors)


def promised(recording: Recording) -> float:
    """Largest difference of a response over the bound of the kernel: 1e-6 of √N·‖x‖₂ of the window, for both signals.

    Half a unit of a sample's last digit is added, for the samples are rounded before.
    """
    single, double = (within_stroke(track(recording.block, dtype=dtype), recording) for dtype in ("float32", "float64"))
    share = np.zeros(double.value.shape)
    for name in ("u", "velocity"):
        windows = np.lib.stride_tricks.sliding_window_view(recording.block[name], WINDOW)[double.first]
        size = np.abs(np.fft.rfft(windows)[:, list(lines().bins)])
        share += (1e-6 + 2.0**-24) * np.sqrt(WINDOW) * np.linalg.norm(windows, axis=1)[:, np.newaxis] / size
    return float(np.max(np.abs(single.value / double.value - 1) / share))


def measure(short: bool = False) -> Result:
    truth, records = Local(), [stroke(seed=seed) for seed in range(1 if short else 4)]
    offsets = OFFSETS[:4:3] if short else OFFSETS
    chosen = dict(list(WAYS.items())[: 2 if short else None])
    found = {
        name: {
            by: [NonOverlappingWindows.of(way, offset(record, by), truth) for record in records]
            for by in offsets
            if way is not ways.by_model or by <= OF_MODEL_MAX
        }
        for name, way in chosen.items()
    }
    rows = []
    for name, each in found.items():
        for by, parts in each.items():
            db = np.concatenate([part.db for part in parts])
            errors = [float(rms(np.array([getattr(p, of) for p in parts]))) for of in ("error_db", "error64_db")]
            rows.append((name, by, f"{rms(db):.2g}", f"{np.max(np.abs(db)):.2g}", *errors))
    header = (
        "method",
        "offset, N m and rad/s",
        "difference, rms dB",
        "largest, dB",
        "error, float32",
        "error, float64",
    )
    caption = (
        f"Difference of \\|G\\| between float32 and float64, whole stroke, {len(records)} strokes; and errors, rms dB"
    )
    verdicts = list(judged(found, [offset(records[0], by) for by in offsets]))
    return Result([Table(caption, header, rows)], verdicts, {"found": found})


def judged(found: dict[str, dict[float, list[NonOverlappingWindows]]], offsets: list[Recording]) -> list[Verdict]:
    verdicts = []
    for name, each in found.items():
        for by, target in LIMITS_DB.items():
            if by in each:
                claim = f"{name}, {f'offset {by:g}' if by else 'no offset'}, difference in rms dB"
                value = float(rms(np.concatenate([part.db for part in each[by]])))
                verdicts.append(Verdict(claim, value, target, why="the window's rms is far above its lines"))
    claim = "largest difference over the bound of the kernel (docs/reference/kernel.md), all offsets"
    worst = max(promised(recording) for recording in offsets)
    return [*verdicts, Verdict(claim, worst, 1.0, why="the bound of the kernel is exceeded")]


def draw(result: Result) -> Figure:
    facts = f"two masses, {STROKE.speed_m_per_s} m/s, window 100 ms, noise 0.1 rad/s; float32 against float64"
    with figure_of("Figs. 8, 9 through the float32 kernel", facts, (11.0, 4.8)) as figure:
        left, right = figure.subplots(1, 2)
        for i, (name, each) in enumerate(result.curves["found"].items()):
            differences = [float(rms(np.concatenate([part.db for part in parts]))) for parts in each.values()]
            at = [max(by, 0.1) for by in each]  # 0 has its place left of the axis of logarithms
            left.loglog(at, differences, "o-", color=LIGHT.traces[i], linewidth=1.3, markersize=4, label=name)
            part = each[0.0][0]
            along = rms(part.db, axis=1)
            right.semilogy(part.position_m, along, color=LIGHT.traces[i], linewidth=0.9, label=name)
        left.axhline(FINEST_DB, color=LIGHT.ink, linewidth=0.8, dashes=(4, 2))
        left.text(0.1, FINEST_DB * 1.2, "the finest target of Fig. 8, 9", size=8, color=LIGHT.ink)
        left.set_xticks([0.1, *OFFSETS[1:]], ["none", *(f"{by:g}" for by in OFFSETS[1:])])
        left.minorticks_off()
        left.set_xlabel("constant offset on w, u and velocity, N m and rad/s")
        left.set_ylabel("difference of |G|, rms, dB")
        left.legend(loc="upper left", bbox_to_anchor=(0.0, 0.82))
        right.set_title("no offset", size=10, loc="left")
        right.set_xlabel("cart position, m")
        right.set_ylabel("difference of |G|, rms over lines, dB")
    return figure


STUDY = Study("float32", "Fig. 8, 9 through float32", PAPER, measure, draw)
