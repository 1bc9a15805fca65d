"""The mean of several recordings: its bounds cover the truth, and it agrees with the robust method."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from livebode.core import Block, Lines, Responses, SignalError
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine
from livebode.fitting import RecordingScatter, RecordingsMean
from tools import bla_reference as reference

RATE_HZ, WINDOW = 1000.0, 100
LINES = Lines.of_bins(range(2, 26, 2), WINDOW, RATE_HZ)
PLANT = 2 / (1 - 0.6 / LINES.z) / LINES.z
ANSWERS = json.loads((Path(__file__).parent / "stored" / "best_linear_approximation.json").read_text())


def tracked(lines: Lines, w: np.ndarray, u: np.ndarray, y: np.ndarray, start: int) -> Responses:
    settings = Settings(lines=lines, excitation="w", input="u", output="y", hop=lines.window)
    return Tracker(settings).process(Block(np.array([w, u, y]), ("w", "u", "y"), RATE_HZ, start=start))


def mean_of(parts: list[Responses], *, realisations: bool = False) -> tuple[Responses, RecordingScatter]:
    mean = RecordingsMean([int(part.first[0]) for part in parts], realisations=realisations)
    for part in Responses.join(parts), parts[0][0:0]:
        mean.add(part)
    return mean.result()


def linear(noises: tuple[float, ...], seed: int, between: float = 0.0, periods: int = 6) -> list[Responses]:
    """Recordings of a linear plant with their noise; the plant of each differs by `between` at every line."""
    rng, parts, w = np.random.default_rng(seed), list[Responses](), multisine(LINES)
    at = np.asarray(LINES.bins)
    for noise in noises:
        spectrum = np.zeros(WINDOW // 2 + 1, dtype=np.complex128)
        own = between / np.sqrt(2) * (rng.standard_normal(len(LINES)) + 1j * rng.standard_normal(len(LINES)))
        spectrum[at] = np.fft.rfft(w)[at] * (PLANT + own)
        y = np.tile(np.fft.irfft(spectrum, WINDOW), periods) + noise * rng.standard_normal(periods * WINDOW)
        u = np.tile(w, periods)
        parts.append(tracked(LINES, u, u, y, len(parts) * (periods + 1) * WINDOW))
    return parts


def covered(noises: tuple[float, ...], between: float, periods: int = 6) -> tuple[float, float]:
    """Shares of 30 runs × 12 lines that the 63 % and the 98 % bounds cover, printed."""
    inside = []
    for seed in range(30):
        one = mean_of(linear(noises, seed, between, periods))[0][0]
        inside.append([np.abs(one.value - PLANT) < one.bound(c) for c in (1, 2)])
    one, two = np.mean(inside, axis=(0, 2))
    print(f"noise {noises}, machines apart by {between}: {one:.1%} and {two:.1%}")
    return one, two


@pytest.mark.parametrize(("noises", "between"), [((0.1, 0.3, 0.05), 0.0), ((0.1, 0.1, 0.3, 0.2), 0.05)])
def test_bounds_cover_recordings_of_different_noise_and_of_machines_that_differ(
    noises: tuple[float, ...], between: float
) -> None:
    """63 % and 98 %: the standard deviations of 360 values are 2.5 % and 0.7 %; three of them."""
    one, two = covered(noises, between)
    assert 0.632 - 0.075 < one < 0.80
    assert two > 0.982 - 0.021


def test_differences_that_are_hardly_detected_are_covered_less_often() -> None:
    """Half as large as the noise of the quieter one in a line's mean; the bounds are at most this much too small."""
    one, two = covered((0.1, 0.3), 0.01, periods=12)
    assert one > 0.52
    assert two > 0.90


def test_the_quiet_recording_counts_more_than_the_noisy_one() -> None:
    """The variance of the mean is that of the quiet recording; equal weights would give 25 times as much.

    In one of 100 runs the recordings differ by chance, and the weights are nearly equal.
    """
    errors = [np.abs(mean_of(linear((0.05, 0.5), seed))[0].value[0] - PLANT) ** 2 for seed in range(30)]
    size = np.abs(np.fft.rfft(multisine(LINES))[np.asarray(LINES.bins)])
    assert np.median(errors * size**2) == pytest.approx(np.log(2) * 0.05**2 * WINDOW / 6, rel=0.15)
    assert np.mean(errors * size**2) < 1.6 * 0.05**2 * WINDOW / 6


def test_noise_alone_rarely_makes_recordings_differ_and_a_changed_machine_does() -> None:
    """1 % of 40 runs: more than 3 happen by chance less than once in 1,000."""
    assert sum(mean_of(linear((0.1, 0.3), seed))[1].differs for seed in range(40)) <= 3
    assert all(mean_of(linear((0.1, 0.1, 0.1), seed, 0.1))[1].differs for seed in range(5))


@pytest.mark.parametrize("cube", ["0", "0.02", "0.1"])
def test_realisations_agree_with_the_package_of_the_robust_method(cube: str) -> None:
    """Weights by 21 lines differ from equal ones by some percent; that moves the mean by a small part of its sigma."""
    w, u, y = reference.records(float(cube))
    lines = Lines.of_bins(reference.BINS, reference.WINDOW, RATE_HZ)
    size = (reference.PERIODS + 1) * reference.WINDOW
    parts = [tracked(lines, *(x[i].ravel() for x in (w, u, y)), i * size) for i in range(len(w))]
    one, between = mean_of(parts, realisations=True)
    expected = {name: np.array(values) for name, values in ANSWERS[cube].items()}
    apart = np.abs(one.value[0] - (expected["re"] + 1j * expected["im"])) / expected["total"]
    assert np.sqrt(np.mean(apart**2)) < 0.2
    for name, own in (("noise", between.noise), ("total", between.total)):
        ratio = own / expected[name]
        assert abs(np.mean(ratio) - 1) < 0.05, name
        assert np.abs(ratio - 1).max() < 0.25, name
    assert between.differs == (cube != "0")
    if between.differs:
        assert one.dof[0] == reference.REALISATIONS - 1
        assert np.array_equal(one.sigma[0], np.fmax(between.total, between.noise))


def test_the_stochastic_distortion_of_a_cube_is_found() -> None:
    """y = 2·u + c·u³, flat lines: the level at the lines is that of the scatter of exact responses over the phases."""
    cube, count = 0.01, 8
    lines = Lines.of_bins(range(1, 64, 2), 256, RATE_HZ)

    def excited(seed: int) -> np.ndarray:
        w = multisine(lines, 1.0, np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines)))
        return np.asarray(w / w.std())

    at = list(lines.bins)
    exact = np.array([np.fft.rfft(2 * w + cube * w**3)[at] / np.fft.rfft(w)[at] for w in map(excited, range(400))])
    truth = np.sqrt(np.mean(np.var(exact, axis=0, ddof=1)))
    rng, found, inside = np.random.default_rng(0), [], []
    for run in range(12):
        parts = []
        for i in range(count):
            u = np.tile(excited(1000 + count * run + i), 5)
            y = 2 * u + cube * u**3 + 0.02 * rng.standard_normal(u.size)
            parts.append(tracked(lines, u, u, y, i * 6 * 256))
        one, between = mean_of(parts, realisations=True)
        assert between.differs
        inside.append([np.abs(one[0].value - exact.mean(axis=0)) < one[0].bound(c) for c in (1, 2)])
        found.append(10 ** (between.distortion_db / 10) * np.mean(np.abs(one.value) ** 2))
    # 12 runs of 7 × 32 degrees of freedom; the phases also change the level of all lines together.
    assert np.sqrt(np.mean(found)) == pytest.approx(truth, rel=0.1)
    # The best linear approximation, at 12 × 32 lines, which are correlated: as 120 independent ones within 3 sigma.
    covered = np.mean(inside, axis=(0, 2))
    assert abs(covered[0] - 0.632) < 0.13
    assert covered[1] > 0.982 - 0.036


def test_one_period_each_gives_the_total_and_no_noise() -> None:
    parts = [part[-1:] for part in linear((0.1, 0.1, 0.1, 0.1), 1)]
    one, between = mean_of(parts, realisations=True)
    assert np.isnan(between.noise).all()
    assert np.array_equal(one.sigma[0], between.total)
    assert one.dof[0] == 3


def test_a_line_in_one_recording_only_is_not_valid() -> None:
    parts = linear((0.1, 0.1), 2)
    parts[1].valid[:, 3] = False
    one, _ = mean_of(parts)
    assert one.valid[0].tolist() == [i != 3 for i in range(len(LINES))]
    parts[1].valid[:] = False
    with pytest.raises(SignalError, match="two of the recordings"):
        mean_of(parts)
