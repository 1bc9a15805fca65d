"""`python -m studies.arrays`: three arrays to a frequency response, by livebode, SciPy and pyFRF.

All get the same recordings of a servo in closed loop (`tools.two_mass_servo`). With --write the table of
docs/explanation/scipy.md is updated. pyFRF is in requirements-bench.lock (`make bench`).
"""

from __future__ import annotations

import argparse
import inspect
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import signal

import livebode
from tools.two_mass_servo import TwoMassServo, multisine, schroeder

PAGE = Path(__file__).parents[1] / "docs" / "explanation" / "scipy.md"
BEGIN, END = "<!-- begin: python -m studies.arrays --write -->", "<!-- end -->"
SECONDS, NOISE_RAD_PER_S = 18, 0.1
C_95 = np.sqrt(-np.log(0.05))
SERVO = TwoMassServo(gain=0.4, integral_time_s=0.15)
PERIOD, LINES_HZ = 4000, np.arange(4, 201, 3)  # bins of the period
RESONANCE, ANTIRESONANCE = LINES_HZ.tolist().index(76), LINES_HZ.tolist().index(43)
fs = SERVO.rate_hz

Answer = tuple[NDArray[Any], NDArray[Any], NDArray[Any] | None]
"""Frequencies in Hz, values, and radii that cover the truth with 95 % probability; None without."""


def by_livebode(w: NDArray[Any], u: NDArray[Any], y: NDArray[Any]) -> Answer:
    response = livebode.frf(w, u, y, fs=fs)
    return response.frequency_hz, response.value, response.bound()


def by_livebode_without_w(u: NDArray[Any], y: NDArray[Any]) -> Answer:
    response = livebode.frf(u, y, fs=fs)
    return response.frequency_hz, response.value, response.bound()


def by_scipy(u: NDArray[Any], y: NDArray[Any]) -> Answer:
    f, s_uy = signal.csd(u, y, fs=fs)
    f, s_uu = signal.welch(u, fs=fs)
    return f, s_uy / s_uu, None


def by_scipy_with_period(u: NDArray[Any], y: NDArray[Any]) -> Answer:
    f, s_uy = signal.csd(u, y, fs=fs, nperseg=PERIOD)
    f, s_uu = signal.welch(u, fs=fs, nperseg=PERIOD)
    return f, s_uy / s_uu, None


def by_scipy_with_coherence(u: NDArray[Any], y: NDArray[Any]) -> Answer:
    f, s_uy = signal.csd(u, y, fs=fs, nperseg=PERIOD)
    f, s_uu = signal.welch(u, fs=fs, nperseg=PERIOD)
    f, coherence = signal.coherence(u, y, fs=fs, nperseg=PERIOD)
    value = s_uy / s_uu
    segments = 2 * len(u) // PERIOD - 1
    share = (1 - coherence) / (coherence * segments)
    return f, value, C_95 * np.abs(value) * np.sqrt(share)


def by_scipy_with_w(w: NDArray[Any], u: NDArray[Any], y: NDArray[Any]) -> Answer:
    f, s_wy = signal.csd(w, y, fs=fs, nperseg=PERIOD)
    f, s_wu = signal.csd(w, u, fs=fs, nperseg=PERIOD)
    return f, s_wy / s_wu, None


def by_pyfrf(u: NDArray[Any], y: NDArray[Any]) -> Answer:
    from pyFRF import FRF

    periods = [x.reshape(-1, PERIOD) for x in (u, y)]
    frf = FRF(int(fs), *periods, resp_type="v", window="none")
    return frf.get_f_axis(), frf.get_FRF(frf_form="mobility")[0, 0], None


PEERS: dict[str, Callable[..., Answer]] = {
    "`livebode.frf(w, u, y)`": by_livebode,
    "`livebode.frf(u, y)`": by_livebode_without_w,
    "`scipy.signal.csd`, as it is": by_scipy,
    "`csd`, nperseg = the period": by_scipy_with_period,
    "the same, bound by coherence": by_scipy_with_coherence,
    "`csd` with w, nperseg = the period": by_scipy_with_w,
    "pyFRF, H1 over periods": by_pyfrf,
}


@dataclass(frozen=True)
class Score:
    """Comparison of a method with the plant at the lines, over all recordings.

    Attributes
    ----------
    lines_of_code
        Statements from the arrays to values, and bounds where there are some.
    error, error_at_resonance
        Root mean square over the recordings, as a share of |G|: the median over the lines, and at the highest |G|.
    bias, bias_sigma
        Mean error at the line next to the antiresonance, as a share of |G|, and its standard deviation.
    covered
        Share of the values whose error is within the 95 % bound; None without.
    """

    lines_of_code: int
    error: float
    error_at_resonance: float
    bias: float
    bias_sigma: float
    covered: float | None


@dataclass(frozen=True)
class Signals:
    """Excitation (samples,), torque and speed (seeds, samples)."""

    w: NDArray[np.float64]
    u: NDArray[np.float64]
    y: NDArray[np.float64]


def recordings(seconds: float, seeds: int, run_in: int = 2 * PERIOD) -> Signals:
    """Recordings that differ in the noise of the speed alone, after `run_in` samples."""
    w = np.resize(0.02 * multisine(LINES_HZ, PERIOD, schroeder(len(LINES_HZ))), round(seconds * fs))
    u, y, _ = SERVO.run(w, NOISE_RAD_PER_S * np.random.default_rng(1).standard_normal((w.size, seeds)))
    return Signals(w[run_in:], np.ascontiguousarray(u[run_in:].T), np.ascontiguousarray(y[run_in:].T))


def score(method: Callable[..., Answer], signals: Signals) -> Score:
    truth, names = SERVO.response(LINES_HZ), inspect.signature(method).parameters
    errors, covered = [], []
    for u, y in zip(signals.u, signals.y):
        arrays = {"w": signals.w, "u": u, "y": y}
        f, value, radius = method(**{name: arrays[name] for name in names})
        at_lines = np.interp(LINES_HZ, f, value.real) + 1j * np.interp(LINES_HZ, f, value.imag)
        errors.append((at_lines - truth) / np.abs(truth))
        if radius is not None:
            covered.append(np.abs(at_lines - truth) <= np.interp(LINES_HZ, f, radius))
    at_antiresonance = np.array(errors)[:, ANTIRESONANCE]
    size = np.sqrt(np.mean(np.abs(errors) ** 2, axis=0))
    return Score(
        lines_of_code(method),
        float(np.median(size)),
        float(size[RESONANCE]),
        float(np.abs(at_antiresonance.mean())),
        float(at_antiresonance.std() / np.sqrt(len(errors))),
        float(np.mean(covered)) if covered else None,
    )


def lines_of_code(method: Callable[..., Answer]) -> int:
    """Lines of the function but the first, imports and blank ones; of the last one what it returns counts as used."""
    body = [line.strip() for line in inspect.getsource(method).splitlines()[1:]]
    return sum(bool(line) and not line.startswith(("from ", "return ")) for line in body)


def table(scores: dict[str, Score], seeds: int) -> str:
    low, high = LINES_HZ[ANTIRESONANCE], LINES_HZ[RESONANCE]
    rows = [
        f"{seeds} recordings of {SECONDS - 2} s.",
        "",
        f"| method | lines of code | error, % | error at {high} Hz, % | bias at {low} Hz, % | 95 % bound covers |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for name, of in scores.items():
        covers = "no bound" if of.covered is None else f"{100 * of.covered:.1f} %"
        errors = f"{100 * of.error:.1f} | {100 * of.error_at_resonance:.1f}"
        bias = f"{100 * of.bias:.0f} ± {200 * of.bias_sigma:.0f}"
        rows.append(f"| {name} | {of.lines_of_code} | {errors} | {bias} | {covers} |")
    return "\n".join(rows)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m studies.arrays", description=__doc__)
    parser.add_argument("--seeds", type=int, default=100, help="recordings")
    parser.add_argument("--write", action="store_true", help="update the table of docs/explanation/scipy.md")
    options = parser.parse_args()
    signals = recordings(SECONDS, options.seeds)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", livebode.SignalWarning)
        text = table({name: score(method, signals) for name, method in PEERS.items()}, options.seeds)
    print(text)
    if options.write:
        before, rest = PAGE.read_text().split(BEGIN)
        PAGE.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{rest.split(END)[1]}")


if __name__ == "__main__":
    main()
