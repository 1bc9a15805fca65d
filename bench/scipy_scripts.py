"""What a user of SciPy would write in place of `livebode run`.

    python -m bench.scipy_scripts responses LOG FOLDER HOP
    python -m bench.scipy_scripts average LOG FOLDER

responses: read, a frequency response and a coherence at each hop, write, two plots. average: the same with one averaged
cross spectrum (`scipy.signal.csd`), which shows no change of the machine. Neither has bounds, checks of the signals,
distortion or events.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.ndimage import uniform_filter1d
from scipy.signal import ShortTimeFFT, csd

from bench.job import BINS, LINES, RATE_HZ, WINDOW


def read(log: Path) -> np.ndarray:
    """w, u and y, shape (3, samples)."""
    table = pq.read_table(log)
    return np.array([column.to_numpy() for column in table.columns])


def responses(log: Path, folder: Path, hop: int) -> None:
    data = read(log)
    transform = ShortTimeFFT(np.ones(WINDOW), hop, RATE_HZ)
    # Its slices are centred; the first complete one is centred half a window after the start.
    first, stop = WINDOW // 2 // hop, (data.shape[1] - WINDOW // 2) // hop + 1
    w, u, y = transform.stft(data, p0=first, p1=stop)[:, BINS]
    value = y * w.conj() / (u * w.conj())

    def mean(power: np.ndarray) -> np.ndarray:
        return uniform_filter1d(power, 10 * WINDOW // hop, axis=1)

    cross = y * w.conj()
    shared = (mean(cross.real) ** 2 + mean(cross.imag) ** 2) / (mean(abs(y) ** 2) * mean(abs(w) ** 2))
    rows = value.shape[1]
    columns = {
        "time_s": np.repeat(transform.t(data.shape[1], p0=first, p1=stop), len(BINS)),
        "frequency_hz": np.tile(LINES.frequency_hz, rows),
        "re": value.real.T.ravel(),
        "im": value.imag.T.ravel(),
        "coherence": shared.T.ravel(),
    }
    pq.write_table(pa.table(columns), folder / "responses.parquet")
    plot(folder, value.mean(axis=1), shared.mean(axis=1))


def average(log: Path, folder: Path) -> None:
    w, u, y = read(log)
    options = {"fs": RATE_HZ, "window": "boxcar", "nperseg": WINDOW, "noverlap": 0}
    wu, wy, ww, yy = (csd(*pair, **options)[1][BINS] for pair in ((w, u), (w, y), (w, w), (y, y)))
    value, shared = wy / wu, abs(wy) ** 2 / (ww * yy).real
    columns = np.array([LINES.frequency_hz, value.real, value.imag, shared]).T
    np.savetxt(folder / "response.csv", columns, delimiter=",", header="frequency_hz,re,im,coherence", comments="")
    plot(folder, value, shared)


def plot(folder: Path, value: np.ndarray, shared: np.ndarray) -> None:
    f = LINES.frequency_hz
    bode, (magnitude, phase) = plt.subplots(2, 1, sharex=True)
    magnitude.semilogx(f, 20 * np.log10(abs(value)))
    magnitude.set_ylabel("dB")
    phase.semilogx(f, np.unwrap(np.angle(value)) * 180 / np.pi)
    phase.set(xlabel="Hz", ylabel="degrees")
    bode.savefig(folder / "bode.png")
    figure, axes = plt.subplots()
    axes.semilogx(f, shared)
    axes.set(xlabel="Hz", ylabel="coherence", ylim=(0, 1.05))
    figure.savefig(folder / "coherence.png")


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["responses", log, folder, hop]:
            responses(Path(log), Path(folder), int(hop))
        case ["average", log, folder]:
            average(Path(log), Path(folder))
        case _:
            raise SystemExit(__doc__)
