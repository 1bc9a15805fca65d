"""The kernel's spectra are those of the last N samples, whatever the configuration."""

import numpy as np
import pytest

from livebode.kernel import SlidingDFT, instruction_sets

# float64, float32: error relative to √N·‖x‖₂ of the window.
BOUND = {"float64": 5e-15, "float32": 1e-6}
SHAPES = [
    (1, [0]),
    (2, [1, 0]),
    (3, [2]),
    (8, [1, 2, 3]),
    (100, list(range(51))),
    (101, [100, 3, 50, 51]),
    (200, list(range(1, 22))),
    (1000, list(range(3, 104))),
]


def windows_of(x: np.ndarray, window: int) -> np.ndarray:
    """(channels, samples, window): the last N samples after each, zeros before the first."""
    padded = np.concatenate([np.zeros((len(x), window - 1)), np.asarray(x, np.float64)], axis=1)
    return np.lib.stride_tricks.sliding_window_view(padded, window, axis=1)


def fixed_phase(spectra: np.ndarray, bins: list[int], window: int, ends: np.ndarray) -> np.ndarray:
    """The phase referred to sample numbers that are multiples of N, exactly reduced."""
    return spectra * np.exp(-2j * np.pi * (np.outer(ends, bins) % window) / window)


def worst(spectra: np.ndarray, truth: np.ndarray, seen: np.ndarray) -> float:
    scale = np.sqrt(seen.shape[-1]) * np.linalg.norm(seen, axis=-1)
    return float(np.max(np.abs(spectra - truth) / scale[..., None]))


@pytest.fixture(params=instruction_sets())
def instruction_set(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setenv("LIVEBODE_INSTRUCTION_SET", request.param)
    return str(request.param)


@pytest.mark.parametrize("dtype", BOUND)
@pytest.mark.parametrize(("window", "bins"), SHAPES, ids=lambda v: str(v) if isinstance(v, int) else f"K{len(v)}")
@pytest.mark.parametrize("offset", [0.0, 1e4])
def test_equals_numpy_fft_of_the_last_samples(window, bins, dtype, offset, instruction_set):
    rng = np.random.default_rng(window)
    x = (offset + rng.standard_normal((2, 3 * window + 17))).astype(dtype)
    seen = windows_of(x, window)
    truth = np.fft.fft(seen)[:, :, bins]
    ends = np.arange(1, x.shape[1] + 1)
    for hop in (1, 7):
        rows = slice(hop - 1, None, hop)
        for phase in ("window", "fixed"):
            dft = SlidingDFT(window, bins, channels=2, dtype=dtype)
            assert dft.instruction_set == instruction_set
            want = truth[:, rows]
            if phase == "fixed":
                want = fixed_phase(want, bins, window, ends[rows])
            got = dft.process(x, hop, phase=phase)
            assert worst(got, want, seen[:, rows]) <= BOUND[dtype]
        assert worst(dft.spectrum(), truth[:, -1], seen[:, -1]) <= BOUND[dtype]


@pytest.mark.parametrize("dtype", BOUND)
def test_error_stays_flat_over_a_million_samples(dtype):
    window, bins, rng = 250, [1, 7, 40, 124], np.random.default_rng(5)
    dft, errors = SlidingDFT(window, bins, dtype=dtype), []
    for _ in range(10):
        x = (100 + rng.standard_normal(100_003)).astype(dtype)
        dft.advance(x)
        last = x[None, -window:].astype(float)
        errors.append(worst(dft.spectrum(), np.fft.fft(last)[0, bins], last))
    assert max(errors) <= BOUND[dtype]
    assert max(errors[5:]) <= 4 * max(errors[:5]), "the error grows"


def test_a_tone_on_its_bin_has_half_its_amplitude_times_n():
    window, k, amplitude, phase = 400, 12, 3.0, 0.7
    n = np.arange(5 * window)
    dft = SlidingDFT(window, [k, k + 1])
    dft.advance(amplitude * np.cos(2 * np.pi * (k * n % window) / window + phase))
    expected = [amplitude * window / 2 * np.exp(1j * phase), 0]
    assert np.allclose(dft.spectrum(), expected, rtol=0, atol=1e-11)


def test_a_constant_is_at_bin_zero_and_nyquist_sees_the_alternation():
    dft = SlidingDFT(10, [0, 5, 3])
    dft.advance(2.0 + np.tile([1.0, -1.0], 20))
    assert np.allclose(dft.spectrum(), [20, 10, 0], rtol=0, atol=1e-13)


def test_ratios_of_channels_do_not_depend_on_the_phase():
    rng = np.random.default_rng(2)
    u = rng.standard_normal(900)
    x = np.stack([u, np.convolve(u, [0.5, 0.2, -0.1])[:900]])
    bins = [3, 5, 8]
    window, fixed = (SlidingDFT(60, bins, 2).process(x, 9, phase=p)[:, 10:] for p in ("window", "fixed"))
    assert np.allclose(window[1] / window[0], fixed[1] / fixed[0], rtol=1e-12)


def test_spectra_of_a_sum_are_the_sum_of_the_spectra():
    rng = np.random.default_rng(3)
    a, b = rng.standard_normal((2, 500))

    def spectra(x):
        return SlidingDFT(64, [0, 3, 32]).process(x)

    assert np.allclose(spectra(2 * a - 3 * b), 2 * spectra(a) - 3 * spectra(b), rtol=0, atol=1e-11)
