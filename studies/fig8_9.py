"""Fig. 8, 9: |G| tracked along a stroke, by the method of the paper and by livebode, two masses and three."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from livebode import Responses
from livebode.simulation import Mechanics
from studies.common import (
    RATE_HZ,
    STROKE,
    Floats,
    Local,
    Recording,
    decibels,
    error_db,
    lines,
    rms,
    stroke,
)
from studies.drawing import LIGHT, figure_of, spread
from studies.result import Result, Study, Table, Verdict
from studies.ways import Way, by_model, by_model_under_w, centre, hann, newest, newest_at_1_ms

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Name, method, and the target in dB.
WAYS: list[tuple[str, Way, float | None]] = [
    ("the paper's: 1 ms, newest sample", newest_at_1_ms, None),
    ("loop's rate, newest sample", newest, None),
    ("loop's rate, window's centre", centre, 0.28),
    ("the same with Hann", hann, 0.23),
    ("with the reference model, driven by u", by_model, 0.15),
    ("with the reference model, driven by w", by_model_under_w, None),
]
PAPER = "|G| tracked along the stroke, line by line, with noise of 0.1 rad/s, compared with (14) at each position."


# Parts of the stroke, each of the windows wholly within it: from this long after the acceleration on (None: with it).
AFTER_S = (None, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5)
PARTS = ("whole stroke", "constant speed", "beyond 0.45 m", "0.5 s after acceleration")


@dataclass(frozen=True)
class Errors:
    """In dB, shape (rows of all records, lines), with where each row lies on the way."""

    db: Floats
    position_m: Floats
    after_s: Floats  # from the acceleration's end to the window's begin; negative, or NaN where it brakes

    @classmethod
    def of(cls, way: Way, records: list[Recording], *truths: Local) -> list[Errors]:
        """Those against each truth."""
        found = [(way(record), record) for record in records]
        after_s = np.concatenate([after_acceleration_s(responses, record) for (responses, _), record in found])
        position_m = np.concatenate([at for (_, at), _ in found])
        each = [[error_db(responses, truth(at)) for (responses, at), _ in found] for truth in truths]
        return [cls(np.concatenate(db), position_m, after_s) for db in each]

    @property
    def parts(self) -> dict[str, float]:
        """Rms over each part of the stroke."""
        every, steady, settled = np.full(len(self.db), True), self.after_s >= 0, self.after_s >= AFTER_S[-1]
        chosen = (every, steady, steady & (self.position_m > 0.45), settled)
        return {name: float(rms(self.db[rows])) for name, rows in zip(PARTS, chosen)}

    @property
    def after(self) -> list[float]:
        """Rms by how much after the acceleration is left out."""
        return [float(rms(self.db if t is None else self.db[self.after_s >= t])) for t in AFTER_S]

    def along(self, edges_m: Floats) -> Floats:
        """Rms over the lines between positions."""
        at = np.digitize(self.position_m, edges_m)
        return np.array([rms(self.db[at == i]) if np.any(at == i) else np.nan for i in range(1, len(edges_m))])


def after_acceleration_s(found: Responses, recording: Recording) -> Floats:
    step = round(RATE_HZ / found.lines.rate_hz)
    speed = recording.block["velocity_reference"]
    flat = np.flatnonzero(speed > 0.9999 * speed.max())
    return np.where(found.sample * step <= flat[-1], (found.first * step - flat[0]) / RATE_HZ, np.nan)


def measure(short: bool = False) -> Result:
    seeds = range(1 if short else 12)
    records, quiet = [stroke(seed=seed) for seed in seeds], [stroke(sigma=0.0)]
    truth, rows, verdicts, found, left_out = Local(), [], [], {}, []
    for name, way, target in WAYS:
        (errors,), (without,) = Errors.of(way, records, truth), Errors.of(way, quiet, truth)
        found[name] = errors
        rows.append((name, *errors.parts.values(), *without.parts.values()))
        if target:
            verdicts += judged(name, errors.parts, without.parts, target)
        left_out.append((name, *errors.after, *without.after))
    header = ("method", *PARTS, *(f"{part}, no noise" for part in PARTS))
    caption = f"Two masses, {len(seeds)} strokes: error of \\|G\\|, rms over all lines in dB"
    per_line = [(name, *rms(errors.db[errors.after_s >= 0], axis=0)) for name, errors in found.items()]
    of_lines = Table(
        "The same by line, constant speed", ("method", *(f"{f:g} Hz" for f in lines().frequency_hz)), per_line
    )
    heads = ["all" if t is None else f"{t:g} s" for t in AFTER_S]
    of_time = Table(
        "The same for windows that begin at least this long after the acceleration, up to braking; all targets are "
        f"met {held_from([(errors.after, target) for errors, (_, _, target) in zip(found.values(), WAYS)])}",
        ("method", *heads, *(f"{head}, no noise" for head in heads)),
        left_out,
    )
    curves = {"record": records[0], "errors": found, "truth": truth}
    return Result([Table(caption, header, rows), of_time, of_lines, three_masses(list(seeds))], verdicts, curves)


def held_from(measured: list[tuple[list[float], float | None]]) -> str:
    """From which of AFTER_S on no target is missed."""
    judged = [np.array(values) <= target for values, target in measured if target is not None]
    missed = np.flatnonzero(~np.all(judged, axis=0))
    first = missed[-1] + 1 if missed.size else 0
    return f"from {AFTER_S[first]:g} s on" if 0 < first < len(AFTER_S) else "nowhere" if first else "everywhere"


def judged(name: str, errors: dict[str, float], without: dict[str, float], target: float) -> list[Verdict]:
    """The target on each part of the stroke."""
    whole, steady, beyond, settled = PARTS
    why = {
        whole: "includes windows during acceleration and braking, and the ringing after them",
        steady: "ringing from the acceleration remains, and near the motor the stiffness changes fastest",
        beyond: "the axis changes within the window (see the error budget)",
        settled: "the axis changes within the window",
    }
    return [
        Verdict(f"{name}, {part}, rms dB", errors[part], target, why=f"{without[part]:.3g} without noise; {why[part]}")
        for part in PARTS
    ]


def three_masses(seeds: list[int]) -> Table:
    """The same on three masses, against two truths."""
    mechanics = Mechanics(masses=3)
    records = [stroke(seed=seed, mechanics=mechanics) for seed in seeds]
    own, two = Local(mechanics), Local()
    rows = []
    for name, way, _ in WAYS:
        rows.append((name, *(e for errors in Errors.of(way, records, own, two) for e in errors.parts.values())))
    header = (f"{part}, {truth}" for truth in ("own linearisation", "(14)") for part in PARTS)
    apart = float(rms(decibels(own(np.linspace(0.3, 1.55, 51)) / two(np.linspace(0.3, 1.55, 51)))))
    caption = (
        f"Three masses: the same, compared with their own linearisation and with (14); these differ by {apart:.2f} dB"
    )
    return Table(caption, ("method", *header), rows)


def draw(result: Result) -> Figure:
    with figure_of(
        "Figs. 8, 9: |G| tracked along the stroke",
        f"two masses, {STROKE.speed_m_per_s} m/s, window 100 ms, noise 0.1 rad/s; dashed: local linearisation",
        (12.0, 5.2),
    ) as figure:
        left, middle, right = figure.subplots(1, 3)
        middle.sharey(left)
        for axes, (name, way, _) in zip((left, middle), (WAYS[0], WAYS[4])):
            _along(axes, result, way)
            axes.set_title(name, size=10, loc="left")
        left.set_ylabel("|G|, dB of 1 rad/s per N m")
        left.set_ylim(-32, 17)
        _errors(right, result)
    return figure


def _along(axes: Axes, result: Result, way: Way) -> None:
    found, at = way(result.curves["record"])
    position_m = np.linspace(0.25, 1.6, 200)
    truth = decibels(result.curves["truth"](position_m))
    for i in range(len(found.lines)):
        colour = LIGHT.traces[i]
        axes.plot(at, found.magnitude_db[:, i], color=colour, linewidth=1.2)
        axes.plot(position_m, truth[:, i], color=LIGHT.ink, linewidth=0.8, dashes=(4, 2))
    order = np.argsort(truth[-1])
    heights = spread(truth[-1, order], 2.0)
    for i, height in zip(order, heights):
        label = f"{found.lines.frequency_hz[i]:g} Hz"
        axes.text(1.63, height, label, size=8, va="center", color=LIGHT.traces[i])
    axes.set_xlim(0.2, 1.85)
    axes.set_xlabel("cart position, m")


def _errors(axes: Axes, result: Result) -> None:
    edges_m = np.linspace(0.25, 1.6, 46)
    for i, (name, errors) in enumerate(result.curves["errors"].items()):
        between = (edges_m[1:] + edges_m[:-1]) / 2
        axes.semilogy(between, errors.along(edges_m), color=LIGHT.traces[i], linewidth=1.3, label=name)
    axes.set_xlabel("cart position, m")
    axes.set_ylabel("error of |G|, rms over lines and strokes, dB")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_ylim(0.06, 120)
    axes.legend(loc="upper center")


STUDY = Study("fig8_9", "Fig. 8, 9: tracking along a stroke", PAPER, measure, draw)
