"""The whole command: `livebode run` on ten minutes at 4 kHz, compared with ShortTimeFFT and a sliding rfft.

Three channels in Parquet, 21 lines, window 400, hop 20: 120,000 responses. The contenders get the samples in memory
and compute only the quotient S_wy/S_wu at the lines; livebode also reads the file, computes bounds and coherence, and
writes a run directory with pictures.
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
import pyarrow as pa
import pyarrow.parquet as pq
import scipy.fft
from scipy.signal import ShortTimeFFT

from livebode.core import Lines
from livebode.excitation import multisine

RATE_HZ, SECONDS, WINDOW, HOP = 4000, 600, 400, 20
LINES = Lines.parse("20:220:10", rate_hz=RATE_HZ, window=WINDOW)
BINS = list(LINES.bins)
TARGET, TARGET_MIB = 20.0, 300.0
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


def by_rfft(data: np.ndarray) -> np.ndarray:
    """scipy.fft.rfft of strided views, in parts that fit into the cache."""
    windows = np.lib.stride_tricks.sliding_window_view(data, WINDOW, axis=1)[:, ::HOP]
    parts = []
    for start in range(0, windows.shape[1], 1024):
        w, u, y = scipy.fft.rfft(windows[:, start : start + 1024], axis=2)[..., BINS]
        parts.append(y * w.conj() / (u * w.conj()))
    return np.concatenate(parts)


def best_s(work: Callable[[], object], repeats: int) -> float:
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def run_livebode(log: Path, out: Path) -> dict[str, float]:
    """Wall time of the whole command, of tracking, and of all but start and pictures; peak memory."""
    options = f"--excitation w --input u --output y --lines 20:220:10 --window {WINDOW} --hop {HOP} --force --json"
    start = time.perf_counter()
    done = subprocess.run(
        [LIVEBODE, "run", str(log), "--out", str(out), *options.split()], check=True, capture_output=True, text=True
    )
    command_s = time.perf_counter() - start
    speed = json.loads(done.stdout)["speed"]
    peak_mib = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    return {"command_s": command_s, "run_s": speed["run_s"], "tracking_s": speed["tracking_s"], "peak_mib": peak_mib}


def measure(repeats: int = 3) -> dict[str, float]:
    """All contenders in one run, seconds."""
    data = signals()
    with tempfile.TemporaryDirectory() as folder:
        log, out = Path(folder) / "log.parquet", Path(folder) / "run"
        names = ("w", "u", "y")
        pq.write_table(pa.table(dict(zip(names, data))).replace_schema_metadata({"rate_hz": str(RATE_HZ)}), log)
        runs = [run_livebode(log, out) for _ in range(repeats)]
        found = pq.read_table(out / "responses.parquet", columns=["re", "im"])
        ours = (found["re"].to_numpy() + 1j * found["im"].to_numpy()).reshape(-1, len(BINS))
    same(ours[WINDOW // HOP - 1 :], by_rfft(data))
    result = {key: min(run[key] for run in runs) for key in runs[0]}
    return result | {
        "start_s": best_s(lambda: subprocess.run([LIVEBODE, "--version"], check=True, capture_output=True), repeats),
        "stft_s": best_s(lambda: by_stft(data), 1),
        "rfft_s": best_s(lambda: by_rfft(data), repeats),
    }


def same(ours: np.ndarray, theirs: np.ndarray) -> None:
    difference = np.max(np.abs(ours - theirs) / np.abs(theirs))
    if not difference < 1e-9:
        raise SystemExit(f"the contenders do not compute the same responses: they differ by {difference:.1e}")


def report(result: dict[str, float]) -> None:
    print(f"ten minutes at 4 kHz, {len(BINS)} lines, window {WINDOW}, hop {HOP}")
    print(f"{'':36}{'seconds':>9}{'ShortTimeFFT is':>17}{'sliding rfft is':>17}")
    rows = {
        "whole command, with pictures": "command_s",
        "reading, tracking, recording": "run_s",
        "tracking alone": "tracking_s",
        "only the start (livebode --version)": "start_s",
    }
    for label, key in rows.items():
        ratios = [result[other] / result[key] for other in ("stft_s", "rfft_s")]
        print(f"{label:36}{result[key]:9.3f}" + "".join(f"{ratio:14.1f} × " for ratio in ratios))
    print(f"{'ShortTimeFFT, responses only':36}{result['stft_s']:9.3f}")
    print(f"{'sliding rfft, responses only':36}{result['rfft_s']:9.3f}")
    reached = result["stft_s"] / result["command_s"]
    print(f"target ≥ {TARGET:g} × for the whole command: {reached:.1f} × ({'met' if reached >= TARGET else 'missed'})")
    peak = result["peak_mib"]
    print(f"peak memory {peak:.0f} MiB, target ≤ {TARGET_MIB:g} ({'met' if peak <= TARGET_MIB else 'missed'})")


if __name__ == "__main__":
    report(measure())
