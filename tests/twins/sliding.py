"""The NumPy twin: the readable definition of what the C kernel computes, one sample at a time.

The same additions and multiplications in the same order, so the kernel must agree with it to the bit (except for the
sign of zeros, where a half period is processed backwards). S_k is the sum
over the last N samples of x·e^(−j2πkj/N), where j is a sample's place in its period of N (Nevaranta 2016, Fig. 4,
after Duda, IEEE SPM 27(6), 2010). F_k is the same sum over the current period alone, and replaces S_k at its end:
therefore errors do not accumulate.
"""

from typing import Any, Final

import numpy as np
import numpy.typing as npt

Real = npt.NDArray[np.floating[Any]]

# a0, a1/2, a2/2 of w(n) = a0 − a1·cos(2πn/N) + a2·cos(4πn/N).
TAPS: Final = {"hann": (0.5, 0.25, 0.0), "hamming": (0.54, 0.23, 0.0), "blackman": (0.42, 0.25, 0.04)}
# The neighbours for the taps, after the bin itself: k−1, k+1, k−2, k+2.
OFFSETS: Final = (0, -1, 1, -2, 2)


def _small_sin(a: Real) -> Real:
    z = a * a
    p: Any = 1.0 / 355687428096000.0
    for sign, n in zip((-1, 1, -1, 1, -1, 1, -1), (1307674368000, 6227020800, 39916800, 362880, 5040, 120, 6)):
        p = p * z + sign * (1.0 / n)
    result: Real = a + a * (z * p)
    return result


def _small_cos(a: Real) -> Real:
    z = a * a
    p = 1.0 / 20922789888000.0 - 1.0 / 6402373705728000.0 * z
    for sign, n in zip((-1, 1, -1, 1, -1, 1), (87178291200, 479001600, 3628800, 40320, 720, 24)):
        p = p * z + sign * (1.0 / n)
    return 1.0 - z * (0.5 - z * p)


def twiddles(window: int) -> tuple[Real, Real]:
    """cos and sin of 2πr/N for r = 0 … N − 1: reduced to [0, π/4] in integers, mirrored about N/2."""
    r = np.arange(window, dtype=np.int64)
    octant, rest = np.divmod(8 * np.minimum(r, window - r), window)
    angle = np.pi / 4 * (np.where(octant % 2, window - rest, rest) / window)
    c, s = _small_cos(angle), _small_sin(angle)
    cosine = np.choose(octant, [c, s, -s, -c, -np.ones(window)])
    sine = np.choose(octant, [s, c, c, s, np.zeros(window)])
    return cosine, np.where(2 * r > window, -sine, sine)


class TwinDFT:
    """What SlidingDFT computes, in NumPy: push samples (channels,), read spectra (channels, bins)."""

    def __init__(
        self,
        window: int,
        bins: npt.ArrayLike,
        channels: int = 1,
        dtype: npt.DTypeLike = np.float64,
        variant: str = "modulated",
        damping: float = 0.9999,
    ) -> None:
        self.window, self.variant, self.count = window, variant, 0
        self.dtype = np.dtype(dtype)
        self.half = (window + 1) // 2
        self.taps = np.array(TAPS.get(variant, (1.0, 0.0, 0.0)), self.dtype)
        reach = OFFSETS if variant in TAPS else OFFSETS[:1]
        k = (np.asarray(bins, np.int64) + np.array(reach)[:, None]) % window  # (offsets, bins)
        steps = np.arange(window)[:, None, None] * k % window
        cosine, sine = twiddles(window)
        self.cosine, self.sine = cosine.astype(self.dtype)[steps], sine.astype(self.dtype)[steps]
        power = 1.0
        for _ in range(window):
            power *= damping if variant == "damped" else 1.0
        self.radius = np.array(damping if variant == "damped" else 1.0, self.dtype)
        self.radius_window = np.array(power, self.dtype)
        self.line = np.zeros((channels, window), self.dtype)
        self.s_re, self.s_im, self.f_re, self.f_im = np.zeros((4, channels, *k.shape), self.dtype)

    def push(self, x: npt.ArrayLike) -> None:
        """One sample of every channel."""
        j = self.count % self.window
        new = np.asarray(x, self.dtype).reshape(-1)
        d = (new - self.radius_window * self.line[:, j])[:, None, None]
        self.line[:, j] = new
        if self.variant in ("plain", "damped"):
            self._recur(d)
        else:
            self.s_re += self.cosine[j] * d
            self.s_im -= self.sine[j] * d
            self._renew(j)
        self.count += 1

    def _recur(self, d: Real) -> None:
        """X_k(n) = (r·X_k(n−1) + x(n) − r^N·x(n−N))·e^(j2πk/N); r = 1 is Nevaranta 2016, eq. (4)."""
        c, s = self.cosine[1 % self.window], self.sine[1 % self.window]
        re, im = self.radius * self.s_re + d, self.radius * self.s_im
        self.s_re, self.s_im = re * c - im * s, im * c + re * s

    def _renew(self, j: int) -> None:
        """F, in the second half of the period: sample j and its mirror image N − j share a twiddle."""
        first, here, image = (self.line[:, i, None, None] for i in (0, j, (self.window - j) % self.window))
        if j == self.half or self.window == 1:
            self.f_re[:], self.f_im[:] = first, 0  # x_0 has no image
        if j >= self.half:
            alone = 2 * j == self.window  # the middle is its own image
            self.f_re += self.cosine[j] * (here if alone else here + image)
            self.f_im -= self.sine[j] * (here if alone else here - image)
        if j == self.window - 1:
            self.s_re, self.s_im = self.f_re.copy(), self.f_im.copy()

    def _turned(self, re: Real, im: Real, sign: int) -> tuple[Real, Real]:
        """times e^(±jθ), θ of the next sample, the oldest of the window."""
        row = self.count % self.window
        c, s = self.cosine[row, : re.shape[1]], sign * self.sine[row, : re.shape[1]]
        return re * c - im * s, im * c + re * s

    def spectrum(self, phase: str = "window") -> npt.NDArray[np.complexfloating[Any, Any]]:
        """(channels, bins): phase "window" as numpy.fft of the last N samples, "fixed" on a grid of period N."""
        re, im = self.s_re, self.s_im
        if self.variant in TAPS:
            re, im = self._turned(re, im, 1)
            a, b, c = self.taps
            re, im = (a * z[:, :1] - b * (z[:, 1:2] + z[:, 2:3]) + c * (z[:, 3:4] + z[:, 4:5]) for z in (re, im))
        if self.variant == "modulated" and phase == "window":
            re, im = self._turned(re, im, 1)
        if self.variant != "modulated" and phase == "fixed":
            re, im = self._turned(re, im, -1)
        out = np.empty((re.shape[0], re.shape[2]), np.result_type(self.dtype, np.complex64))
        out.real, out.imag = re[:, 0], im[:, 0]
        return out

    def process(
        self, x: npt.ArrayLike, hop: int = 1, phase: str = "window"
    ) -> npt.NDArray[np.complexfloating[Any, Any]]:
        """Samples (channels, samples) to spectra (channels, rows, bins): a row where the count is a multiple of hop."""
        rows = []
        for sample in np.asarray(x, self.dtype).T:
            self.push(sample)
            if self.count % hop == 0:
                rows.append(self.spectrum(phase))
        return np.stack(rows, axis=1) if rows else np.empty((len(self.line), 0, self.s_re.shape[2]), complex)
