"""Work that every version of livebode can do: by the public interface and the command line only.

`python scenarios.py FOLDER SCENARIO`, run by the Python of one version: prepares the work, then does it once for each
line on standard input, and prints the processor seconds of one repetition. Nothing else of `bench` is imported, for the
other version does not have it.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

RATE_HZ, WINDOW, LINES = 4000.0, 400, "20:220:10"
NAMES = ("w", "u", "y", "position")
TURN_S = 0.04
Work = Callable[[], object]


def recording(seconds: float) -> np.ndarray:
    """w, u, y and a position, shape (4, samples): a rigid axis with a resonance, with noise."""
    import scipy.signal

    from livebode import Lines, multisine

    rng = np.random.default_rng(0)
    w = np.resize(multisine(Lines.parse(LINES, rate_hz=RATE_HZ, window=WINDOW)), round(RATE_HZ * seconds))
    u = w + 0.01 * rng.standard_normal(w.size)
    s = np.array([[1, 20, 2e5], [1, 25, 4e5]])
    b, a, _ = scipy.signal.cont2discrete((400 * s[0], np.convolve(s[1], [1, 0.5])), 1 / RATE_HZ)
    y = scipy.signal.lfilter(b.ravel(), a, u) + 0.001 * rng.standard_normal(w.size)
    return np.array([w, u, y, np.linspace(0.0, 1.0, w.size)])


def write_recordings(folder: Path) -> None:
    """The recordings that the commands read: Parquet of a minute, CSV and JSON lines of some seconds."""
    import pyarrow as pa
    import pyarrow.csv
    import pyarrow.parquet as pq

    minute = recording(60.0)
    table = pa.table(dict(zip(NAMES, minute))).replace_schema_metadata({"rate_hz": str(RATE_HZ)})
    pq.write_table(table, folder / "minute.parquet")
    part = minute[:, :40_000]
    stamped = pa.table({"time_s": np.arange(part.shape[1]) / RATE_HZ, **dict(zip(NAMES, part))})
    pyarrow.csv.write_csv(stamped, folder / "part.csv")
    head = {"rate_hz": RATE_HZ, "channels": NAMES}
    starts = range(0, part.shape[1], 100)
    rows = [json.dumps({"sample": i, "data": part[:, i : i + 100].tolist(), **head}) for i in starts]
    (folder / "part.ndjson").write_text("\n".join(rows) + "\n", encoding="utf-8")
    signals = 'excitation = "w"\ninput = "u"\noutput = "y"'
    (folder / "live.toml").write_text(
        f'[source]\nurl = "stdin:"\n[signals]\n{signals}\n[lines]\nfrequencies = "{LINES}"\nwindow = {WINDOW}\n'
        "[tracking]\nhop = 20\n",
        encoding="utf-8",
    )


def blocks(hop: int, phase: str) -> Work:
    from livebode import SlidingDFT

    x, bins = np.random.default_rng(1).standard_normal(4096 * hop), list(range(1, 22))
    dft, out = SlidingDFT(WINDOW, bins), np.empty((4096, len(bins)), complex)

    def task() -> None:
        for _ in range(20):
            dft.process(x, hop, out, phase)  # type: ignore[arg-type]

    return task


def push() -> Work:
    from livebode import SlidingDFT

    dft = SlidingDFT(WINDOW, list(range(1, 22)))

    def task() -> None:
        for _ in range(5_000):
            dft.push(0.25)

    return task


def tracking(block_samples: int, **options: object) -> Work:
    """Four seconds in blocks of this length; the stream continues from one call to the next."""
    from livebode import Block, Lines, Settings, Tracker

    data = recording(4.0)
    lines = Lines.parse(LINES, rate_hz=RATE_HZ, window=WINDOW)
    tracker = Tracker(Settings(lines=lines, excitation="w", input="u", output="y", hop=20, **options))  # type: ignore[arg-type]
    start = 0

    def task() -> None:
        nonlocal start
        for i in range(0, data.shape[1], block_samples):
            tracker.process(Block(data[:, i : i + block_samples], NAMES, RATE_HZ, start=start))
            start += min(block_samples, data.shape[1] - i)

    return task


def fitting() -> Work:
    """Two masses on a belt, whose stiffness changes by 20 %, fitted to 200 responses, 16 at a time."""
    from livebode import Fitter, Lines, Responses
    from livebode.fitting import TwoMass

    lines, rows, rng = Lines.parse("20:120:5", rate_hz=RATE_HZ, window=800), np.arange(200), np.random.default_rng(2)
    inertia, mass_kg, damping, radius_m = 0.0028, 6.7, 130.0, 0.019
    s, stiffness = 2j * np.pi * lines.frequency_hz, 5e5 * (1 + 0.2 * np.sin(np.linspace(0, np.pi, 200)))[:, None]
    belt = damping * s + stiffness
    continuous = (mass_kg * s**2 + belt) / (s * (inertia * mass_kg * s**2 + (inertia + mass_kg * radius_m**2) * belt))
    truth = continuous * (1 - np.exp(-s / RATE_HZ)) / (s / RATE_HZ)  # the input is held
    sigma = 0.005 * np.abs(truth)
    noise = sigma * (rng.standard_normal(truth.shape) + 1j * rng.standard_normal(truth.shape)) / np.sqrt(2)
    ones = np.ones(truth.shape)
    found = Responses(
        lines=lines, value=truth + noise, sigma=sigma, dof=np.full(200, np.inf), coherence=ones, valid=ones > 0,
        first=20 * rows, sample=20 * rows + 799, time_s=0.005 * rows, schedule=np.full(200, np.nan),
    )  # fmt: skip

    def task() -> None:
        fitter = Fitter(TwoMass(radius_m=radius_m))
        for i in range(0, 200, 16):
            fitter.process(found[i : i + 16])

    return task


def simulation() -> Work:
    from livebode import BeltAxis, SimulatedAxis, Strokes

    w = recording(0.1)[0]
    axis = SimulatedAxis(BeltAxis(motion=Strokes(), excitation_n_m=w, seconds=10.0))
    return lambda: sum(len(block) for block, _ in axis.pairs())


def recognition() -> Work:
    from livebode import recognise

    w = recording(10.0)[0]
    return lambda: recognise(w, RATE_HZ)


def reading(folder: Path) -> Work:
    from livebode import open_log

    return lambda: sum(len(block) for block in open_log(folder / "part.csv").blocks(list(NAMES)))


TRACK = f"--excitation w --input u --output y --lines {LINES} --window {WINDOW} --hop 20 --force --json"
RUN = f"run minute.parquet --out OWN/run {TRACK}"
IN_PROCESS: dict[str, Callable[[Path], Work]] = {
    "kernel, every sample": lambda _: blocks(1, "window"),
    "kernel, hop 20": lambda _: blocks(20, "window"),
    "kernel, sample by sample": lambda _: push(),
    "tracker, blocks of 4,000": lambda _: tracking(4000),
    "tracker, blocks of 100": lambda _: tracking(100),
    "tracker, joint, average": lambda _: tracking(4000, estimator="joint", average=True),
    "fits, 16 at a time": lambda _: fitting(),
    "simulated axis": lambda _: simulation(),
    "recognise an excitation": lambda _: recognition(),
    "read CSV": reading,
}
# Name: the command before the measured one, and the measured one; OWN is a directory of this version.
COMMANDS: dict[str, tuple[str, str]] = {
    "livebode --version": ("", "--version"),
    "livebode inspect": ("", "inspect minute.parquet --excitation w --output y --json"),
    "livebode run, a minute": ("", RUN),
    "livebode run, live, 10 s": ("", "run live.toml --out OWN/live --force --json"),
    "livebode fit": (RUN, "fit OWN/run --json"),
    "livebode report": (RUN, "report OWN/run --force"),
}


def command(folder: Path, own: Path, words: str) -> float:
    """Processor seconds of a command with all its threads and children."""
    program = str(Path(sys.executable).with_name("livebode"))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with (folder / "part.ndjson").open("rb") as lines:
        arguments = words.replace("OWN", str(own)).split()
        done = subprocess.run([program, *arguments], cwd=folder, stdin=lines, capture_output=True)
    if done.returncode not in (0, 3):
        raise SystemExit(f"livebode {words} failed: {done.stderr.decode()[-2000:]}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def repeated(work: Work) -> float:
    """Processor seconds of the cheapest repetition within a turn."""
    best, end = np.inf, time.process_time() + TURN_S
    while time.process_time() < end:
        began = time.process_time()
        work()
        best = min(best, time.process_time() - began)
    return float(best)


def main() -> None:
    folder, name = Path(sys.argv[1]), sys.argv[2]
    with tempfile.TemporaryDirectory() as own:
        if name in COMMANDS:
            first, words = COMMANDS[name]
            for text in (first, words):
                if text:
                    command(folder, Path(own), text)
            turn: Callable[[], float] = lambda: command(folder, Path(own), words)  # noqa: E731
        else:
            work = IN_PROCESS[name](folder)
            work()
            turn = lambda: repeated(work)  # noqa: E731
        print("ready", flush=True)
        for _ in sys.stdin:
            print(turn(), flush=True)


if __name__ == "__main__":
    main()
