"""Fig. 8, 9: |G| tracked along a stroke, by the paper's way and by ours, two masses and three."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from livebode import Block, Responses
from livebode.simulation import Mechanics
from studies.common import (
    RATE_HZ,
    STROKE,
    WINDOW,
    Floats,
    Local,
    Recording,
    Result,
    Study,
    Table,
    Verdict,
    decibels,
    error_db,
    lines,
    rms,
    stroke,
    track,
    within_stroke,
)
from studies.drawing import LIGHT, figure_of, spread

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Found = tuple[Responses, Floats]  # and the position that each is dated at
Way = Callable[[Recording], Found]


def newest_at_1_ms(recording: Recording) -> Found:
    """The paper's way: every fourth sample, N = 100, dated at the newest sample."""
    block = recording.block
    slow = Block(block.data[:, ::4], block.channels, block.rate_hz / 4)
    found = track(slow, WINDOW // 4, hop=5)
    shown = (found.first * 4 >= recording.first) & (found.sample * 4 <= recording.last)
    found = found[int(np.flatnonzero(shown)[0]) : int(np.flatnonzero(shown)[-1]) + 1]
    return found, slow["x"][found.sample]


def newest(recording: Recording) -> Found:
    found = within_stroke(track(recording.block), recording)
    return found, recording.block["x"][found.sample]


def centre(recording: Recording, **options: object) -> Found:
    found = within_stroke(track(recording.block, **options), recording)
    return found, found.schedule


def hann(recording: Recording) -> Found:
    return centre(recording, hann=True)


# Name, what it does (None: has its place here, but is not built yet), and the target in dB.
WAYS: list[tuple[str, Way | None, float | None]] = [
    ("the paper's: 1 ms, newest sample", newest_at_1_ms, None),
    ("loop's rate, newest sample", newest, None),
    ("loop's rate, window's centre", centre, 0.28),
    ("the same with Hann", hann, 0.23),
    ("with the reference model", None, 0.15),
]
PAPER = "|G| tracked along the stroke, line by line, with noise of 0.1 rad/s, against (14) at each position."


# Parts of the stroke, each of the windows wholly within it.
PARTS = ("whole stroke", "constant speed", "beyond 0.45 m")


@dataclass(frozen=True)
class Errors:
    """In dB, shape (rows of all records, lines), with where each row lies on the way."""

    db: Floats
    position_m: Floats
    steady: NDArray[np.bool_]

    @classmethod
    def of(cls, way: Way, truth: Local, records: list[Recording]) -> Errors:
        found = [(way(record), record) for record in records]
        db = np.concatenate([error_db(responses, truth(at)) for (responses, at), _ in found])
        steady = np.concatenate([at_constant_speed(responses, record) for (responses, _), record in found])
        return cls(db, np.concatenate([at for (_, at), _ in found]), steady)

    @property
    def parts(self) -> dict[str, float]:
        """Rms over each part of the stroke."""
        chosen = (np.full(len(self.db), True), self.steady, self.steady & (self.position_m > 0.45))
        return {name: float(rms(self.db[rows])) for name, rows in zip(PARTS, chosen)}

    def along(self, edges_m: Floats) -> Floats:
        """Rms over the lines between positions."""
        at = np.digitize(self.position_m, edges_m)
        return np.array([rms(self.db[at == i]) if np.any(at == i) else np.nan for i in range(1, len(edges_m))])


def at_constant_speed(found: Responses, recording: Recording) -> NDArray[np.bool_]:
    """Whether the reference's speed is the same in a row's whole window."""
    step = round(RATE_HZ / found.lines.rate_hz)
    speed = recording.block["velocity_reference"]
    flat = np.flatnonzero(speed > 0.9999 * speed.max())
    return np.asarray((found.first * step >= flat[0]) & (found.sample * step <= flat[-1]))


def measure(short: bool = False) -> Result:
    seeds = range(2 if short else 12)
    records, quiet = [stroke(seed=seed) for seed in seeds], [stroke(sigma=0.0)]
    truth, rows, verdicts, found = Local(), [], [], {}
    for name, way, target in WAYS:
        if way is None:
            verdicts += [Verdict(f"{name}, rms dB", None, target or 0.0, why="not measured by this study yet")]
            continue
        errors, without = Errors.of(way, truth, records), Errors.of(way, truth, quiet)
        found[name] = errors
        rows.append((name, *errors.parts.values(), *without.parts.values()))
        if target:
            verdicts += judged(name, errors.parts, without.parts, target)
    header = ("way", *PARTS, *(f"{part}, no noise" for part in PARTS))
    caption = f"Two masses, {len(seeds)} strokes: error of \\|G\\|, rms over all lines in dB"
    per_line = [(name, *rms(errors.db[errors.steady], axis=0)) for name, errors in found.items()]
    of_lines = Table(
        "The same by line, constant speed", ("way", *(f"{f:g} Hz" for f in lines().frequency_hz)), per_line
    )
    curves = {"record": records[0], "errors": found, "truth": truth}
    return Result([Table(caption, header, rows), of_lines, three_masses(list(seeds))], verdicts, curves)


def judged(name: str, errors: dict[str, float], without: dict[str, float], target: float) -> list[Verdict]:
    """The target on the whole stroke, and on the part where the stiffness changes slowly."""
    whole, steady, beyond = PARTS
    why = (
        f"{without[whole]:.3g} without noise; {errors[steady]:.3g} at constant speed, where the window neither "
        f"accelerates nor brakes; {errors[beyond]:.3g} beyond 0.45 m, for the stiffness changes fastest near the motor"
    )
    later = f"{without[beyond]:.3g} without noise: the axis changes within the window, and the error budget splits that"
    return [
        Verdict(f"{name}, {whole}, rms dB", errors[whole], target, why=why),
        Verdict(f"{name}, {beyond}, rms dB", errors[beyond], target, why=later),
    ]


def three_masses(seeds: list[int]) -> Table:
    """The same on three masses, against two truths."""
    mechanics = Mechanics(masses=3)
    records = [stroke(seed=seed, mechanics=mechanics) for seed in seeds]
    own, two = Local(mechanics), Local()
    rows = []
    for name, way, _ in WAYS:
        if way is not None:
            rows.append((name, *(e for truth in (own, two) for e in Errors.of(way, truth, records).parts.values())))
    header = (f"{part}, against {truth}" for truth in ("their own", "(14)") for part in PARTS)
    apart = float(rms(decibels(own(np.linspace(0.3, 1.55, 51)) / two(np.linspace(0.3, 1.55, 51)))))
    caption = (
        f"Three masses: the same against their own linearisation and against (14); the two are {apart:.2f} dB apart"
    )
    return Table(caption, ("way", *header), rows)


def draw(result: Result) -> Figure:
    with figure_of(
        "Figs. 8, 9: |G| tracked along the stroke",
        f"two masses, {STROKE.speed_m_per_s} m/s, window 100 ms, noise 0.1 rad/s; dashed: local linearisation",
        (12.0, 5.2),
    ) as figure:
        left, middle, right = figure.subplots(1, 3)
        middle.sharey(left)
        for axes, (name, way, _) in zip((left, middle), (WAYS[0], WAYS[3])):
            _along(axes, result, way)
            axes.set_title("loop's rate, centre, Hann" if way is hann else name, size=10, loc="left")
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
    axes.legend(loc="upper center")


STUDY = Study("fig8_9", "Fig. 8, 9: tracking along a stroke", PAPER, measure, draw)
