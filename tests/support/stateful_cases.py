"""Each class with a state as a run uses it: a small instance, and input that changes its state."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from livebode.configuration import FitSection, ReadyCondition
from livebode.core import Block, Channel, Event, Lines, MatrixResponses, Responses, Spectra, SpectraLayout
from livebode.estimation import (
    NonPeriodicTracker,
    RippleOrder,
    Settings,
    SpectraTracker,
    SuccessiveTrackers,
    Tracker,
    UnevenTracker,
)
from livebode.excitation import MatrixExcitation, multisine
from livebode.fitting import DriftTest, EvaluationGrid, Fitter, MatrixDriftTest, Repetitions, TwoMass
from livebode.monitoring import (
    Baseline,
    Monitor,
    NonOverlappingWindows,
    TorqueMonitor,
    learn_table,
    places,
    signals_of,
)
from livebode.motion import MotionCorrection
from livebode.preparation import ChannelCheck
from livebode.runtime import ChangeDetection, Fits
from livebode.runtime.continuing import StreamPosition
from livebode.runtime.readiness import Readiness
from livebode.runtime.run_counts import RunCounts
from livebode.simulation import BeltAxis, Sensor, SimulatedAxis, Strokes, TensionLoss
from livebode.sources.live import Batch, LiveBlock, Origin, Sequencer, SourceEvents
from livebode.sources.live.kernel_drive import KernelDrive
from livebode_matrix import MatrixMonitor, MatrixSettings, MatrixTracker, example_matrix_responses
from livebode_matrix.detection import MatrixDetection
from livebode_matrix.response_matrix import MatrixColumns
from livebode_plant.fleet.axis_stream import AxisStream
from livebode_plant.fleet.message import write_message
from tests.support.axes import LINES as AXIS_LINES
from tests.support.fitted import LINES as FITTED
from tests.support.fitted import TRUTH, noisy
from tests.support.fleet_runs import batch as numbered_message
from tests.support.fleet_runs import fleet_axes
from tests.support.matrices import matrices as random_matrices
from tests.support.monitored import ideal, recorded
from tests.support.stateful import Case
from tests.support.strokes import learned_torque
from tests.support.strokes import strokes as rigid_strokes

BELT = TwoMass(radius_m=0.019)
RATE_HZ, WINDOW = 1000.0, 50
LINES = Lines.parse("20:140:20", rate_hz=RATE_HZ, window=WINDOW)
RIPPLE = (RippleOrder(40.0, 0.1),)
SETTINGS = Settings(
    lines=LINES, excitation="w", input="u", output="y", schedule="x", hop=10, spikes=("y",), ripple=RIPPLE,
    differenced=("y",),
)  # fmt: skip
MOVING = Settings(
    lines=Lines.parse("20:140:20", rate_hz=4000.0, window=200), output="velocity", input="u", excitation="w",
    schedule="x", hop=20,
)  # fmt: skip
MONITORED = Settings(lines=AXIS_LINES, output="velocity", input="u", excitation="w", schedule="x", noise="quiet")
LAYOUT = SpectraLayout(
    (Channel("y"), Channel("u"), Channel("w")), (Channel("x"),), WINDOW, 10, LINES.bins, quiet=LINES.quiet
)


@cache
def block() -> Block:
    """Thirty periods with noise, a spike, a value that is not finite, and a position that moves."""
    rng = np.random.default_rng(5)
    w = np.tile(multisine(LINES), 30)
    u, x = w + 0.01 * rng.standard_normal(w.size), np.linspace(0.0, 1.0, w.size)
    y = 2 * np.roll(u, 1) + 0.01 * rng.standard_normal(w.size)
    y[900] += 100.0
    y[400] = np.nan
    return Block(np.array([y, u, w, x]), ("y", "u", "w", "x"), RATE_HZ)


def processed(parts: Sequence[Block | Responses]) -> list[Callable[[Any], object]]:
    def step(part: Block | Responses) -> Callable[[Any], object]:
        def run(stage: Any) -> object:
            events: list[Event] = []
            return stage.process(part, events.append), events

        return run

    return [step(part) for part in parts]


def cut(whole: Block, *edges: int) -> list[Block]:
    return [whole.cut(a, b) for a, b in zip((0, *edges), (*edges, len(whole)))]


def tracker() -> Case:
    def other() -> Tracker:
        return Tracker(Settings(lines=LINES, excitation="w", input="u", output="y", hop=5))

    def configured() -> Tracker:
        return Tracker(SETTINGS)

    return Case(configured, processed(cut(block(), 333, 777, 1100)), [other])


def direct_tracker() -> Case:
    def new(window: int = WINDOW) -> Tracker:
        lines = Lines.parse("20:140:20", rate_hz=RATE_HZ, window=window)
        return Tracker(Settings(lines=lines, input="u", output="y", estimator="direct", hop=10))

    return Case(new, processed(cut(block(), 333, 777, 1100)), [lambda: new(2 * WINDOW)])


def averaging_tracker() -> Case:
    def new(window: int = WINDOW) -> Tracker:
        lines = Lines.parse("20:140:20", rate_hz=RATE_HZ, window=window)
        return Tracker(Settings(lines=lines, input="u", output="y", excitation="w", hop=10, average=True))

    return Case(new, processed(cut(block(), 333, 777, 1100)), [lambda: new(2 * WINDOW)])


def _nonperiodic(estimator: str) -> Case:
    def new(forgetting: float = 0.8) -> NonPeriodicTracker:
        return NonPeriodicTracker(
            Settings(
                lines=LINES, excitation="w", input="u", output="y", schedule="x", hop=10, average=True,
                estimator=estimator, forgetting=forgetting,
            )
        )  # fmt: skip

    return Case(new, processed(cut(block(), 333, 777, 1100)), [lambda: new(0.9)])


def local_polynomial() -> Case:
    return _nonperiodic("lpm")


def welch_average() -> Case:
    return _nonperiodic("welch")


def spectra() -> Iterator[Spectra]:
    made = KernelDrive(LAYOUT, "float64").spectra(iter(cut(block(), 500, 1000)))
    for batch in made:
        yield batch.block(batch.first_sample, batch.first_sample, gap=False)


def spectra_tracker() -> Case:
    settings = Settings(lines=LINES, excitation="w", input="u", output="y", schedule="x", hop=10, ripple=RIPPLE)
    other = Settings(lines=LINES, excitation="w", input="u", output="y", schedule="x", hop=10)
    return Case(
        lambda: SpectraTracker(settings, LAYOUT),
        processed(list(spectra())),
        [lambda: SpectraTracker(other, LAYOUT)],
    )


def uneven_tracker() -> Case:
    settings = Settings(lines=LINES, excitation="w", input="u", output="y", schedule="x", hop=10)
    other = replace(settings, average=True)
    return Case(
        lambda: UnevenTracker(settings, LAYOUT),
        processed(list(spectra())),
        [lambda: UnevenTracker(other, LAYOUT)],
    )


def matrix_tracker() -> Case:
    """Two inputs and two outputs, with a sample that is missing."""
    u = np.tile(MatrixExcitation.orthogonal(LINES, 2).samples, 4)
    data = np.vstack([u, [[2.0, 1.0], [0.5, 3.0]] @ u])
    data[:, 2 * WINDOW + 7] = np.nan
    names = ("u1", "u2", "y1", "y2")
    settings = MatrixSettings(lines=LINES, output=names[2:], input=names[:2], estimator="direct", hop=10, memory=2)
    parts = cut(Block(data, names, RATE_HZ), WINDOW + 3, 3 * WINDOW)

    def step(stage: MatrixTracker, part: Block) -> object:
        found = stage.process(part)
        return found.value, found.sample, stage.counts

    return Case(
        lambda: MatrixTracker(settings),
        [lambda stage, part=part: step(stage, part) for part in parts],
        [lambda: MatrixTracker(replace(settings, memory=3))],
    )


def matrix_columns() -> Case:
    """Of the example's matrices, in two steps; in the second all are valid."""
    matrices = example_matrix_responses()
    inputs, lines = matrices.inputs, len(matrices.lines)

    def step(stage: MatrixColumns, part: MatrixResponses) -> object:
        stage.add(part)
        return stage.summary(matrices.frequency_hz), stage.valid

    return Case(
        lambda: MatrixColumns(inputs, lines),
        [lambda stage, part=part: step(stage, part) for part in (matrices[:1], matrices[1:2], matrices[2:])],
        [lambda: MatrixColumns(inputs, lines + 1)],
    )


def matrix_monitor() -> Case:
    """Changed in the second step, as before in the third."""
    matrices = example_matrix_responses()

    def part(number: int, factor: float) -> MatrixResponses:
        at = 10**6 * number
        return replace(matrices, value=factor * matrices.value, first=matrices.first + at, sample=matrices.sample + at)

    def monitor(days: float = 30.0) -> MatrixMonitor:
        return MatrixMonitor(matrices, false_alarm_interval_s=86400 * days)

    parts = part(1, 1.0), part(2, 1.2), part(3, 1.0)
    return Case(monitor, [lambda stage, one=one: stage.process(one) for one in parts], [lambda: monitor(1.0)])


def matrix_detection() -> Case:
    matrices = example_matrix_responses()
    changed = replace(
        matrices, value=1.2 * matrices.value, first=matrices.first + 10**6, sample=matrices.sample + 10**6
    )
    steps = [lambda stage, one=one: stage.process(one) for one in (matrices, changed)]
    return Case(lambda: MatrixDetection(MatrixMonitor(matrices), "runs/healthy"), steps)


def successive_trackers() -> Case:
    """The second recording begins in the second step; odd lines have levels of distortion."""
    odd = replace(SETTINGS, lines=Lines.of_bins((1, 3, 7), WINDOW, RATE_HZ))

    def new() -> SuccessiveTrackers:
        return SuccessiveTrackers([Tracker(odd), Tracker(odd)], [0, 777])

    return Case(new, processed(cut(block(), 777, 1100)))


@cache
def strokes() -> Block:
    axis = BeltAxis(
        motion=Strokes(start_m=0.4, end_m=1.2, speed_m_per_s=1.0),
        excitation_n_m=multisine(MOVING.lines),
        sensor=Sensor(noise_rad_per_s=0.1),
        seconds=1.6,
    )
    return SimulatedAxis(axis).run()[0]


def motion_correction() -> Case:
    def new(**options: Any) -> MotionCorrection:
        return MotionCorrection(MOVING, **{"radius_m": 0.019, "chunk_samples": 2400} | options)

    return Case(new, processed(cut(strokes(), 2700, 5000)), [lambda: new(radius_m=0.02)])


@cache
def responses() -> Responses:
    """Fifty of a belt axis with a wandering stiffness, four of them of nothing."""
    values = np.repeat(TRUTH[np.newaxis], 50, axis=0)
    values[:, 2] *= np.linspace(1.0, 1.2, 50)
    found = noisy(BELT.at(values, EvaluationGrid.of(FITTED)), FITTED, 0.01, 50)
    value = found.value.copy()
    value[30:34] = np.nan
    return replace(found, value=value, valid=np.isfinite(value), unit="rad/s/(N m)")


def rows() -> list[Responses]:
    return [responses()[a:b] for a, b in ((0, 7), (7, 33), (33, 37), (37, 50))]


def fitter() -> Case:
    return Case(lambda: Fitter(BELT), processed(rows()), [lambda: Fitter(BELT, free=["delay"])])


def drift() -> Case:
    def step(part: Responses) -> Callable[[Any], object]:
        return lambda test: (test.add(part), test.result().change.tobytes())

    return Case(lambda: DriftTest(FITTED), [step(part) for part in rows()], [lambda: DriftTest(LINES)])


def matrix_drift() -> Case:
    """Of averages over two repetitions, with a gap after the fourth row; in the last step the repetitions are full."""
    value = random_matrices(9, LINES, seed=1)
    count = np.array([1, 2, 2, 2, 1, 2, 2, 2, 2])
    sample = 100 * np.arange(9) + 500
    averages = replace(value, sample=sample, first=sample - 60 - 100 * (count - 1) + 1)

    def step(part: MatrixResponses) -> Callable[[Any], object]:
        return lambda test: (test.add(part), test.result().value.tobytes())

    def new(memory: int) -> MatrixDriftTest:
        return MatrixDriftTest((len(LINES), 2, 2), LINES.rate_hz, Repetitions(60, 100, memory))

    parts = averages[:3], averages[3:6], averages[6:]
    return Case(lambda: new(2), [step(part) for part in parts], [lambda: new(3)])


def baseline(by_model: bool) -> Baseline:
    """Of an ideal machine, with a table from responses that scatter."""
    lines, rng = MONITORED.lines, np.random.default_rng(9)
    value = 1.0 + 0.01 * (rng.standard_normal((400, len(lines))) + 1j * rng.standard_normal((400, len(lines))))
    found = Responses.join([plain_responses(value)])
    at = places(lines.window, MONITORED.step)
    parts = [NonOverlappingWindows(lines.window, place).of_responses(found) for place in at]
    table = learn_table("lines", [f"{f:g} Hz" for f in lines.frequency_hz], parts, len(at))
    return Baseline(
        lines, MONITORED.step, signals_of(MONITORED), "joint", "plant", (table,), ideal() if by_model else None
    )


def plain_responses(value: np.ndarray) -> Responses:
    """A response a window."""
    lines, count = MONITORED.lines, len(value)
    newest = lines.window * np.arange(1, count + 1) - 1
    return Responses(
        lines=lines, value=value, sigma=np.full(value.shape, 0.01), dof=np.full(count, np.inf),
        coherence=np.ones(value.shape), valid=np.ones(value.shape, dtype=bool), first=newest + 1 - lines.window,
        sample=newest, time_s=newest / lines.rate_hz, schedule=np.full(count, np.nan),
    )  # fmt: skip


def monitor_by_model() -> Case:
    learned = baseline(by_model=True)
    whole = recorded((0.3, 0.3), TensionLoss(start_s=2.0, loss=0.05), seed=41)
    steps = [lambda stage, part=part: stage.process_samples(part) for part in cut(whole, 4001, 9000, 14000)]
    return Case(
        lambda: Monitor(learned, MONITORED),
        [*steps, lambda stage: stage.finish()],
        [lambda: Monitor(learned, MONITORED, 9 * 86400.0)],
    )


def changing() -> list[Responses]:
    """Responses that change at the fortieth."""
    rng = np.random.default_rng(10)
    value = (
        1.0 + 0.01 * rng.standard_normal((90, len(MONITORED.lines))) + np.where(np.arange(90) > 40, 0.1, 0.0)[:, None]
    )
    found = plain_responses(value.astype(np.complex128))
    return [found[a:b] for a, b in ((0, 30), (30, 44), (44, 90))]


def monitor_by_tables() -> Case:
    learned = baseline(by_model=False)
    steps = [lambda stage, part=part: stage.process_responses(part) for part in changing()]
    return Case(lambda: Monitor(learned, MONITORED), steps, [lambda: Monitor(baseline(True), MONITORED)])


def torque_monitor() -> Case:
    learned, whole = learned_torque(), rigid_strokes(1000, from_s=30.0, friction=1.5)
    return Case(
        lambda: TorqueMonitor(learned, ("u", "y"), whole.rate_hz, 86400.0),
        [lambda stage, part=part: stage.process(part) for part in cut(whole, 4001, 43000, 61000)],
        [lambda: TorqueMonitor(learned, ("u", "y"), whole.rate_hz, 9 * 86400.0)],
    )


def change_detection() -> Case:
    learned = baseline(by_model=False)
    steps = [lambda stage, part=part: stage.take_responses(part, None) for part in changing()]
    return Case(lambda: ChangeDetection(Monitor(learned, MONITORED), "baseline.json"), steps)


def fits() -> Case:
    section = FitSection(model="two-mass", output="velocity", radius_m=0.019)
    return Case(lambda: Fits(section), [lambda stage, part=part: stage.process(part) for part in rows()])


def run_counts() -> Case:
    def step(part: Block, kind: str) -> Callable[[RunCounts], object]:
        def run(stage: RunCounts) -> object:
            stage.check.take(part)
            stage.take(responses().valid, 0.25)
            stage.stop, stage.left_out_samples = part.stop, part.start
            event = Event(kind, part.stop, part.stop / RATE_HZ, f"{kind} at {part.stop}", {"count": 1})
            return [stage.groups.take(event) for _ in range(30)], stage.counts({"samples": part.stop})

        return run

    steps = [step(part, kind) for part, kind in zip(cut(block(), 500, 1000), ("gap", "spike", "gap"))]
    return Case(
        lambda: RunCounts(ChannelCheck(("w", "u", "y"), "w"), time.perf_counter()), steps, volatile=frozenset({"run_s"})
    )


def readiness() -> Case:
    """Ready, then not, at the end again for less than a window."""
    state = np.ones(900)
    state[300:320] = state[500:880] = 0.0
    parts = cut(Block(state[np.newaxis], ("on",), RATE_HZ), 310, 600)

    def step(stage: Readiness, part: Block) -> object:
        marked = stage.mark(responses()[5:10])
        return [vars(event) for event in stage.take(part)], marked.ready.tolist(), stage.summary(RATE_HZ)

    return Case(
        lambda: Readiness(ReadyCondition("on"), WINDOW),
        [lambda stage, part=part: step(stage, part) for part in parts],
        [lambda: Readiness(ReadyCondition("on", 1), WINDOW), lambda: Readiness(ReadyCondition("on"), WINDOW, 10)],
    )


def sequencer() -> Case:
    """Batches that wait for one before them, then one that is far ahead: the next two of those are accepted."""
    far = 10 * int(RATE_HZ)

    def step(numbers: Sequence[int]) -> Callable[[Sequencer], object]:
        return lambda stage: [
            (block.start, block.gap, block.data) for number in numbers for block in stage.push(numbered_batch(number))
        ]

    def new(reorder: int = 2) -> Sequencer:
        return Sequencer(SourceEvents(), reorder=reorder)

    return Case(new, [step((100, 110, 130)), step((120, far)), step((far + 10,))], [lambda: new(3)])


def numbered_batch(first: int) -> Batch:
    """Ten samples from number `first` on, each of them its own number."""
    data = np.arange(first, first + 10, dtype=float)[np.newaxis]
    return Batch(first, data, (Channel("y"),), RATE_HZ, epoch=3, stamp_s=1e9 + first / RATE_HZ, arrived_s=1.0)


def axis_stream() -> Case:
    """Messages of the log, one of them damaged, and samples that are missing."""
    ((_, axis),) = fleet_axes(1).items()
    other = axis.model_copy(update={"tracking": axis.tracking.model_copy(update={"hop": 50})})

    def step(numbers: range) -> Callable[[AxisStream], object]:
        return lambda stage: [taken(stage, number) for number in numbers]

    def taken(stage: AxisStream, number: int) -> object:
        message = b"damaged" if number == 12 else write_message(numbered_message(0, 50 * (number + (number > 20))))
        output = stage.process(message, number, 1e9 + 0.05 * number)
        return output.number, [] if output.responses is None else [output.responses.value, output.responses.sample]

    return Case(
        lambda: AxisStream(axis, 1),
        [step(range(1, 11)), step(range(11, 25)), step(range(25, 40))],
        [lambda: AxisStream(other, 1)],
    )


def stream_position() -> Case:
    """It continues only where its own record ends, so a restored one is made from the snapshot."""
    origin = Origin(epoch=3, offset=100, mark={"name": "a.csv", "offset": 17})
    blocks = [
        LiveBlock(np.ones((1, 5)), (Channel("y"),), RATE_HZ, start=5 * n, arrived_s=10.0, origin=origin)
        for n in range(3)
    ]
    steps = [lambda stage, part=part: stage.take(part) for part in blocks]
    return Case(StreamPosition, steps, volatile=frozenset({"arrived"}), continuing=StreamPosition)


CASES = {
    case.__name__: case
    for case in (
        tracker, direct_tracker, averaging_tracker, successive_trackers,
        matrix_tracker, matrix_columns, matrix_monitor, matrix_detection,
        local_polynomial, welch_average, spectra_tracker,
        uneven_tracker, motion_correction, fitter, drift, matrix_drift,
        monitor_by_model, monitor_by_tables, change_detection, fits, torque_monitor,
        run_counts, readiness, sequencer, axis_stream, stream_position,
    )
}  # fmt: skip
