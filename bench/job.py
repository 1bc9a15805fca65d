"""The whole command: `livebode run` on ten minutes at 4 kHz, compared with ShortTimeFFT and a sliding rfft.

Three channels in Parquet, 21 lines, window 400, hop 20: 120,000 responses. The contenders get the samples in memory
and compute only the quotient S_wy/S_wu at the lines; livebode also reads the file, computes bounds and coherence, and
writes a run directory with pictures. ShortTimeFFT is also timed as what a user would run: a process that reads the
file, computes, and writes the quotients.

livebode's tracker and the sliding rfft write into memory that exists: memory from the system for 40 MB of results was
a fifth of the tracker's time and a seventh of the rfft's.

All take turns; each figure is the least of the rounds, in processor time, which a busy computer changes less than the
time on the wall. ShortTimeFFT is slower in a new process, whose memory the system has to prepare: the ratios for the
command are to that, those for tracking alone to the best call in a process that has the memory.
"""

from __future__ import annotations

import gc
import json
import os
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import scipy.fft
from scipy.signal import ShortTimeFFT

from bench.processes import Processes
from livebode.core import Block, Lines
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine

RATE_HZ, SECONDS, WINDOW, HOP = 4000, 600, 400, 20
LINES = Lines.parse("20:220:10", rate_hz=RATE_HZ, window=WINDOW)
BINS = list(LINES.bins)
TARGETS = {"command": 6.0, "tracking": 40.0, "tracking_rfft": 3.0}
PICTURES_S_MAX, PEAK_MIB_MAX = 0.2, 300.0
BLOCK = 1 << 16  # samples, as a file is read
ROUNDS = 3
LIVEBODE = str(Path(sys.executable).with_name("livebode"))


def signals() -> np.ndarray:
    """w, u, y, shape (3, samples)."""
    rng = np.random.default_rng(0)
    w = np.resize(multisine(LINES), RATE_HZ * SECONDS)
    u = w + 0.1 * rng.standard_normal(w.size)
    return np.array([w, u, np.roll(u, 3) + 0.1 * rng.standard_normal(w.size)])


def by_stft(data: np.ndarray) -> np.ndarray:
    """SciPy's ShortTimeFFT with a rectangular window, only complete windows."""
    transform = ShortTimeFFT(np.ones(WINDOW), HOP, RATE_HZ)
    # Its slices are centred; the first complete one is centred half a window after the start.
    w, u, y = transform.stft(data, p0=WINDOW // 2 // HOP, p1=(data.shape[1] - WINDOW // 2) // HOP + 1)[:, BINS]
    return (y * w.conj() / (u * w.conj())).T


def by_rfft(data: np.ndarray, out: np.ndarray) -> np.ndarray:
    """scipy.fft.rfft of strided views, in parts that fit into the cache."""
    windows = np.lib.stride_tricks.sliding_window_view(data, WINDOW, axis=1)[:, ::HOP]
    for start in range(0, windows.shape[1], 1024):
        w, u, y = scipy.fft.rfft(windows[:, start : start + 1024], axis=2)[..., BINS]
        out[start : start + w.shape[0]] = y * w.conj() / (u * w.conj())
    return out[: windows.shape[1]]


def tracked(data: np.ndarray, out: np.ndarray) -> np.ndarray:
    """livebode's tracker on the samples in memory, with bounds and coherence."""
    tracker = Tracker(Settings(lines=LINES, output="y", input="u", excitation="w", hop=HOP))
    names, size = ("w", "u", "y"), data.shape[1]
    blocks = (Block(data[:, at : at + BLOCK], names, rate_hz=RATE_HZ, start=at) for at in range(0, size, BLOCK))
    end = 0
    for block in blocks:
        value = tracker.process(block).value
        out[end : end + len(value)] = value
        end += len(value)
    return out[:end]


def as_script(log: Path, out: Path) -> None:
    """What a user would run in place of livebode: read, compute, write."""
    table = pq.read_table(log)
    value = by_stft(np.array([table[name].to_numpy() for name in ("w", "u", "y")]))
    columns = {"frequency_hz": np.tile(LINES.frequency_hz, len(value)), "re": value.real.ravel()}
    pq.write_table(pa.table(columns | {"im": value.imag.ravel()}), out)


def bound(log: Path, run: Path, out: Path) -> None:
    """Read the recording and write the table of the run, without any work between; print the seconds."""
    from livebode.records import RESPONSES

    written = pq.read_table(run / "responses.parquet")
    begun = time.process_time()
    pq.read_table(log)
    pq.write_table(written, out, compression="lz4", use_dictionary=list(RESPONSES.repeating))
    print(time.process_time() - begun)


def pictures(run: Path) -> None:
    """Draw the pictures of a run; print the seconds of the first time, which loads Matplotlib, and of the best."""
    import livebode.pictures
    from livebode.analysis import Overview
    from livebode.cli.start import OBJECTS_NEW
    from livebode.records import RunRecord

    gc.set_threshold(OBJECTS_NEW)  # as in the command
    overview = Overview()
    for responses in RunRecord.open(run).batches():
        overview.add(responses)
    found = overview.responses()
    times = []
    for _ in range(4):
        begun = time.process_time()
        livebode.pictures.save_pictures(found, run, title="log.parquet: y", names=("u", "y"))
        times.append(time.process_time() - begun)
    print(times[0], min(times))


def processor_s(work: Callable[[], object]) -> float:
    begun = time.process_time()
    work()
    return time.process_time() - begun


def run_livebode(processes: Processes, log: Path, out: Path) -> dict[str, float]:
    """Processor and wall time of the whole command, and the wall time of all but start and pictures; peak memory."""
    options = f"--excitation w --input u --output y --lines 20:220:10 --window {WINDOW} --hop {HOP} --force --json"
    command_s, wall_s, output = processes.run(LIVEBODE, "run", str(log), "--out", str(out), *options.split())
    peak_mib = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    run_s = json.loads(output)["speed"]["run_s"]
    return {"command_s": command_s, "command_wall_s": wall_s, "run_s": run_s, "peak_mib": peak_mib}


def measure(rounds: int = ROUNDS) -> dict[str, float]:
    """All contenders in one run, seconds, the least of the rounds."""
    found: list[dict[str, float]] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        log, out, processes = folder / "log.parquet", folder / "run", Processes(folder / "bytecode")
        write_log(log)  # in a function, so that the forked children do not begin with the memory of the samples
        itself = (sys.executable, "-m", "bench.job")
        processes.run(LIVEBODE, "run", "--help")  # writes the bytecode
        for _ in range(rounds):
            one = run_livebode(processes, log, out)
            one["start_s"] = processes.run(LIVEBODE, "--version")[0]
            one["script_s"], one["script_wall_s"], _ = processes.run(*itself, "script", str(log), str(folder / "q"))
            one["pictures_first_s"], one["pictures_s"] = map(
                float, processes.run(*itself, "pictures", str(out))[2].split()
            )
            arrow_s = processes.run(sys.executable, "-c", "import numpy, pyarrow.parquet")[0]
            one["bound_s"] = arrow_s + float(processes.run(*itself, "bound", str(log), str(out), str(folder / "b"))[2])
            found.append(one)
        table = pq.read_table(out / "responses.parquet", columns=["re", "im"])
        ours = (table["re"].to_numpy() + 1j * table["im"].to_numpy()).reshape(-1, len(BINS))
    data, room = signals(), np.zeros((RATE_HZ * SECONDS // HOP, len(BINS)), np.complex128)
    same(ours[WINDOW // HOP - 1 :], by_rfft(data, room))
    for one in found:
        one["tracking_s"] = processor_s(lambda: tracked(data, room))
        one["stft_first_s"] = one["stft_s"] = processor_s(lambda: by_stft(data))
        one["rfft_s"] = processor_s(lambda: by_rfft(data, room))
    result = {key: min(one[key] for one in found) for key in found[0]}
    return result | {"stft_first_s": found[0]["stft_first_s"]}


def write_log(log: Path) -> None:
    table = pa.table(dict(zip(("w", "u", "y"), signals())))
    pq.write_table(table.replace_schema_metadata({"rate_hz": str(RATE_HZ)}), log)


def same(ours: np.ndarray, theirs: np.ndarray) -> None:
    difference = np.max(np.abs(ours - theirs) / np.abs(theirs))
    if not difference < 1e-9:
        raise SystemExit(f"the contenders do not compute the same responses: they differ by {difference:.1e}")


def report(result: dict[str, float]) -> None:
    print(f"ten minutes at 4 kHz, {len(BINS)} lines, window {WINDOW}, hop {HOP}; processor time, load {load()}")
    print(f"{'':42}{'seconds':>9}{'ShortTimeFFT is':>17}{'sliding rfft is':>17}")
    rows = {
        "whole command, with pictures": ("command_s", "stft_first_s"),
        "tracking alone, samples in memory": ("tracking_s", "stft_s"),
        "only the start (livebode --version)": ("start_s", "stft_first_s"),
    }
    for label, (key, stft) in rows.items():
        ratios = [result[other] / result[key] for other in (stft, "rfft_s")]
        print(f"{label:42}{result[key]:9.3f}" + "".join(f"{ratio:14.1f} × " for ratio in ratios))
    for label, key in {
        "start of NumPy, Arrow; reading, writing": "bound_s",
        "ShortTimeFFT, first call of a process": "stft_first_s",
        "ShortTimeFFT, best call": "stft_s",
        "ShortTimeFFT, a process that reads, writes": "script_s",
        "sliding rfft": "rfft_s",
        "pictures, with Matplotlib's load": "pictures_first_s",
        "pictures, Matplotlib loaded beside the run": "pictures_s",
    }.items():
        print(f"{label:42}{result[key]:9.3f}")
    wall = result["script_wall_s"] / result["command_wall_s"]
    print(f"on the wall: the command {result['command_wall_s']:.3f} s, the process of ShortTimeFFT {wall:.1f} × that")
    print(f"the command: {result['command_s'] / result['bound_s']:.1f} × what starts NumPy and Arrow, reads and writes")
    first = result["stft_first_s"] / result["command_wall_s"]
    print(f"ShortTimeFFT in memory, its first call: {first:.1f} × the command on the wall")
    script = result["script_s"] / result["command_s"]
    print(f"the process of ShortTimeFFT: {script:.1f} × the command in processor time")
    reached = {
        "whole command, ShortTimeFFT": (result["stft_first_s"] / result["command_s"], TARGETS["command"]),
        "tracking alone, ShortTimeFFT": (result["stft_s"] / result["tracking_s"], TARGETS["tracking"]),
        "tracking alone, sliding rfft": (result["rfft_s"] / result["tracking_s"], TARGETS["tracking_rfft"]),
    }
    for label, (ratio, target) in reached.items():
        print(f"{label}: {ratio:.1f} ×, target ≥ {target:g} × ({'met' if ratio >= target else 'missed'})")
    for label, key, most in (
        ("pictures", "pictures_s", PICTURES_S_MAX),
        ("peak memory, MiB", "peak_mib", PEAK_MIB_MAX),
    ):
        print(f"{label}: {result[key]:.3g}, target ≤ {most:g} ({'met' if result[key] <= most else 'missed'})")


def load() -> str:
    return f"{os.getloadavg()[0]:.1f} on {os.cpu_count()} processors"


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["script", log, out]:
            as_script(Path(log), Path(out))
        case ["bound", log, run, out]:
            bound(Path(log), Path(run), Path(out))
        case ["pictures", run]:
            pictures(Path(run))
        case _:
            report(measure())
