"""Whether bounds from all periods of a real recording but one contain the one that was left out.

Run `python -m studies.leave_one_out`; the recordings are beside the project, in `../shared/data`, and one that is not
there is skipped. Each period is left out once. The others are tracked with default settings, with and without averaging
(the newest period alone), and so is the one left out, alone. Their difference scatters by the sigma of the others and
by the noise of the period left out, which is the sigma of one response of the others. A recording of two records of one
period each has no scatter without the other: there each record is estimated by the local polynomial method, whose sigma
comes from neighbouring lines. The bounds promise 63 and 98 %.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from livebode import Block, Lines, Response, Settings, Tracker
from livebode.estimation import NonPeriodicTracker
from livebode.sources import open_log
from studies.common import Floats

DATA = Path(__file__).parents[2] / "shared" / "data"
Pairs = Iterator[tuple[Response, Response, Response]]


@dataclass(frozen=True)
class Bench:
    """A recording: its file, how to read it, which periods are settled, and how they are tracked."""

    name: str
    file: str
    read: Callable[[Path], Block]
    periods: range
    settings: Settings


def whole(path: Path, channels: tuple[str, ...]) -> Block:
    """All samples of some channels."""
    log = open_log(path)
    data = np.concatenate([block.data for block in log.blocks(channels)], axis=1)
    return Block(data, list(channels), log.rate_hz)


def emps(path: Path) -> Block:
    """The difference of two runs on one trajectory, which isolates the injection."""
    names = ("qm", "vir")
    quiet, injected = whole(path.with_name("DATA_EMPS.mat"), names), whole(path, (*names, "pulses_N"))
    data = injected.data.copy()
    data[:2] -= quiet.data
    return Block(data, [*names, "pulses_N"], injected.rate_hz)


def benches() -> list[Bench]:
    """The recordings."""
    motor, spindle = Lines.parse("11:250:1", rate_hz=2500, window=2500), Lines.of_bins(range(5, 301), 2047, 8000.0)
    axis = Lines.parse("5:61:2", rate_hz=1000, window=1000)
    return [
        Bench(
            "motorbench",
            "motorbench/MultisineTypeA.mat",
            lambda path: whole(path, ("iq_refx", "iq_adx", "theta_mx")),
            range(3, 20),
            Settings(lines=motor, excitation="iq_refx", input="iq_adx", output="theta_mx", hop=2500),
        ),
        Bench(
            "emps, difference of two runs",
            "emps/DATA_EMPS_PULSES.mat",
            emps,
            range(2, 24),
            Settings(lines=axis, excitation="pulses_N", input="vir", output="qm", hop=1000),
        ),
        Bench(
            "sinumerik, two records",
            "sinumerik/freq_trace.XML",
            lambda path: whole(path, ("input", "output")),
            range(2),
            Settings(lines=spindle, input="input", output="output", estimator="lpm", hop=2047),
        ),
    ]


def period(bench: Bench, block: Block, number: int) -> Block:
    """One period, numbered apart from the others: the one left out is not between its neighbours."""
    window = bench.settings.lines.window
    piece = block.cut(window * number, window * (number + 1))
    return Block(piece.data, piece.channels, piece.rate_hz, start=2 * window * number)


def pairs(bench: Bench, block: Block, average: bool) -> Pairs:
    """For each period: the estimate from the others, one response of the others, and the period alone."""
    settings = replace(bench.settings, average=average)
    for left_out in bench.periods:
        if not settings.periodic:
            both = [NonPeriodicTracker(settings).process(period(bench, block, n))[-1] for n in (left_out, 1 - left_out)]
            yield both[1], both[0], both[0]
            continue
        trackers = Tracker(settings), Tracker(bench.settings)
        for number in bench.periods:
            if number != left_out:
                others, one = (tracker.process(period(bench, block, number))[-1] for tracker in trackers)
        yield others, one, Tracker(bench.settings).process(period(bench, block, left_out))[-1]


def measure(bench: Bench, block: Block, average: bool) -> tuple[list[float], float, int]:
    """Shares within the 63 % and the 98 % bound, the median bound in % of the response, and the number of values."""
    inside, widths = [list[Floats](), list[Floats]()], list[Floats]()
    for others, one, alone in pairs(bench, block, average):
        for hits, factor in zip(inside, (1, 2)):
            bound = np.hypot(others.bound(factor), one.bound(factor))
            hits.append(np.abs(alone.value - others.value)[np.isfinite(bound)] <= bound[np.isfinite(bound)])
        widths.append(others.sigma / np.abs(others.value))
    shares = [100 * float(np.mean(np.concatenate(hits))) for hits in inside]
    return shares, 100 * float(np.nanmedian(np.concatenate(widths))), sum(map(len, inside[0]))


def main() -> int:
    print("| recording | average | periods | values | median sigma | within 63 % | within 98 % |")
    print("|---|---|---|---|---|---|---|")
    for bench in benches():
        if not (DATA / bench.file).is_file():
            print(f"{bench.name} is skipped: {bench.file} is not beside the project (../shared/data)", file=sys.stderr)
            continue
        block = bench.read(DATA / bench.file)
        for average in (False, True) if bench.settings.periodic else (False,):
            (low, high), width, values = measure(bench, block, average)
            name = f"{bench.name} | {'yes' if average else 'no'} | {len(bench.periods)}"
            print(f"| {name} | {values} | {width:.2g} % | {low:.1f} % | {high:.1f} % |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
