"""Offline reference: the frequency response of a whole recording by Welch's method, for chirps and noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from livebode.core import Lines, Response, SignalError, UsageError, needing, series_of
from livebode.estimation.products import power
from livebode.estimation.quotient import independent_windows

_SEGMENTS = 8


def welch(
    *signals: ArrayLike, fs: float, window: int | None = None, overlap: float = 0.5, taper: str = "hann"
) -> Response:
    """H1 = S_uy/S_uu, or with an excitation the joint estimate S_wy/S_wu, from averaged tapered segments.

    Nevaranta 2016, eqs. (1), (2) and coherence (18). The lines are all bins of the window between 0 and the Nyquist
    frequency. H1 is biased in closed loop; the joint estimate is not. Both are biased where the response
    changes within the taper's width (about 4 bins for Hann), worst at a lightly damped resonance. For an excitation
    that is periodic in the window use `livebode.frf` or the Tracker, which have no such bias.

    Parameters
    ----------
    *signals
        ``(u, y)`` or ``(w, u, y)``: input and output, or excitation, input and output; each of shape (samples,), all
        samples finite. Arrays, lists or columns, as in `livebode.frf`.
    fs
        Samples per second.
    window
        Segment length, samples. Default: an eighth of the samples.
    overlap
        Overlap of neighbouring segments as a share of their length, 0 … 0.9.
    taper
        Name of a window in SciPy.

    Returns
    -------
    Response
        Its effective time is the middle of the samples. `sigma` is from the power that the response does not
        explain, `dof` the number of independent segments less one.

    Raises
    ------
    LivebodeError
        If the signals are shorter than two segments or have non-finite samples.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> u = rng.standard_normal(20_000)
    >>> response = welch(u, 2 * u, fs=1000, window=200)
    >>> len(response.lines), response.value[0].round(6), response.coherence[0].round(6)
    (99, np.complex128(2+0j), np.float64(1.0))
    """
    if len(signals) not in (2, 3):
        raise UsageError(
            "wrong-shape",
            f"welch got {len(signals)} signals",
            "call welch(u, y, fs=4000) or, with the excitation, welch(w, u, y, fs=4000)",
            argument="signals",
        )
    if not 0 <= overlap <= 0.9:
        raise UsageError(
            "out-of-range",
            f"{overlap=} is not between 0 and 0.9",
            "take for example 0.5",
            argument="overlap",
            value=overlap,
            low=0,
            high=0.9,
        )
    found = series_of(**dict(zip("wuy"[-len(signals) :], signals)))
    u, y, w = (found[name].values for name in ("u", "y", "w" if len(signals) == 3 else "u"))
    window = max(3, u.size // _SEGMENTS) if window is None else window
    lines = Lines(tuple(range(1, (window + 1) // 2)), window, fs)
    step = window - int(overlap * window)
    segments = 1 + (u.size - window) // step
    if segments < 2:
        raise SignalError(
            "too-short",
            f"{u.size} samples are less than two segments of {window}",
            "take a shorter window",
            samples=u.size,
            window=window,
        )
    if not np.isfinite(u.sum() + y.sum() + w.sum()):
        raise SignalError("not-finite", "the recording has samples that are not finite", "cut it before or after them")

    last = window + (segments - 1) * step - 1
    with needing("SciPy", "analysis", "the estimator welch"):
        from scipy import signal  # takes half a second to import

    def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        _, s = signal.csd(a, b, fs=fs, window=taper, nperseg=window, noverlap=window - step, detrend="constant")
        return np.asarray(s[1 : len(lines) + 1])

    s_wy, s_wu, s_ww = cross(w, y), cross(w, u), cross(w, w).real
    s_uy, s_uu, s_yy = cross(u, y), cross(u, u).real, cross(y, y).real
    with np.errstate(divide="ignore", invalid="ignore"):
        value = s_wy / s_wu
        unexplained = np.maximum(s_yy - 2 * (value.conj() * s_uy).real + power(value) * s_uu, 0.0)
        independent = independent_windows(segments, step, signal.get_window(taper, window))
        sigma = np.sqrt(unexplained * s_ww / (independent - 1)) / np.abs(s_wu)
        coherence = power(s_wy) / (s_ww * s_yy)
    return Response(
        lines=lines,
        value=value,
        sigma=sigma,
        dof=independent - 1,
        coherence=coherence,
        valid=np.isfinite(value),
        first=0,
        sample=last,
        time_s=last / 2 / fs,
        estimator="welch",
    )
