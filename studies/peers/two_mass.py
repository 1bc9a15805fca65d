"""Two masses as everybody is judged by: livebode's closed form, and its minimal fit of each response alone."""

from __future__ import annotations

import numpy as np

from livebode.fitting import two_masses
from livebode.fitting.two_masses import fit_windows

RADIUS_M = 0.019
ARM = np.array([1.0, RADIUS_M**2, RADIUS_M**2, RADIUS_M**2])  # to the motor's shaft
NOMINAL = np.array([0.0028, 6.7, 5.0e5, 130.0])  # Js, mL, Keff, bs: Table I with the cart in the middle
STARTS = NOMINAL[2] * np.geomspace(0.4, 4.0, 10)
APART_MAX = 20.0  # no parameter of a fit leaves its nominal value by more than this factor


def response(parameters: np.ndarray, frequency_hz: np.ndarray, rate_hz: float) -> np.ndarray:
    """Torque to motor velocity, sampled; Js, mL, Keff, bs in (…, 4) and (lines,) to (…, lines)."""
    return two_masses.sampled(np.log(np.asarray(parameters) * ARM), _z(frequency_hz, rate_hz), rate_hz)


def fit(measured: np.ndarray, frequency_hz: np.ndarray, rate_hz: float) -> np.ndarray:
    """Js, mL, Keff, bs for each row of responses, shape (rows, lines) to (rows, 4); NaN where a row is not finite.

    All lines alike, as white noise and equal lines ask for, from the best of ten stiffnesses.
    """
    found = np.full((len(measured), 4), np.nan)
    good = np.isfinite(measured).all(axis=1)
    data, z = measured[good], _z(frequency_hz, rate_hz)
    starts = np.tile(NOMINAL, (len(STARTS), 1))
    starts[:, 2] = STARTS
    costs = np.sum(np.abs(data[:, np.newaxis] - response(starts, frequency_hz, rate_hz)) ** 2, axis=-1)
    begin = np.log(starts * ARM)[np.argmin(costs, axis=1)]
    with np.errstate(all="ignore"):  # what is no machine's response drives a fit anywhere
        logs, _ = fit_windows(data, np.ones(data.shape), z, rate_hz, begin)
    found[good] = np.clip(np.exp(logs) / ARM, NOMINAL / APART_MAX, NOMINAL * APART_MAX)
    return found


def _z(frequency_hz: np.ndarray, rate_hz: float) -> np.ndarray:
    return np.exp(2j * np.pi * frequency_hz / rate_hz)
