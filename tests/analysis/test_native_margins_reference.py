"""Margins in C are those that NumPy reads from the same loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.analysis import OpenLoop, margins
from livebode.analysis.open_loop import series_of
from livebode.core import PID, Loop, Parameters
from livebode.fitting import PhysicalModel, Rigid, TwoMass, TwoMassGain
from tests.support.belt_loops import BAND_HZ
from tools.loops import BELT, Case, parameters

RATE_HZ = 4000.0


class NumpyTwoMass(TwoMass):
    """A user's model, as far as the kernel knows."""


class NumpyRigid(Rigid):
    """A user's model, as far as the kernel knows."""


class NumpyGain(TwoMassGain):
    """A user's model, as far as the kernel knows."""


def fits_of(model: PhysicalModel, value: np.ndarray, covariance: np.ndarray) -> Parameters:
    nothing = np.zeros(len(value))
    return Parameters(
        model=model.name, names=model.names, units=model.units, value=value, covariance=covariance,
        status=np.full(len(value), "ok"), epsilon=nothing, chi2=nothing, dof=nothing, sample=np.arange(len(value)),
        time_s=nothing, schedule=nothing,
    )  # fmt: skip


def covariance_of(value: np.ndarray, free: int, seed: int) -> np.ndarray:
    """Correlated, 1 % of each of the first `free` parameters."""
    mixed = np.random.default_rng(seed).standard_normal((len(value), free, free))
    whole = np.zeros((*value.shape, value.shape[1]))
    left = mixed * 0.01 * np.abs(value[:, :free, np.newaxis]) / np.sqrt(free)
    whole[:, :free, :free] = left @ left.swapaxes(1, 2)
    return whole


@st.composite
def loops(draw: st.DrawFn) -> tuple[OpenLoop, OpenLoop, Parameters]:
    """The same loop for the kernel and for NumPy, and three fits: stable and unstable loops, with and without delay."""
    kind, seed = draw(st.sampled_from(["belt", "belt", "rigid", "gain"])), draw(st.integers(0, 2**32 - 1))
    hz, damping = draw(st.floats(20.0, 400.0)), draw(st.floats(0.01, 1.5))
    gain, ticks = draw(st.floats(0.02, 3.0)), draw(st.integers(0, 8))
    factors = np.random.default_rng(seed).uniform(0.7, 1.4, (3, 1))
    position = draw(st.booleans())
    if kind == "belt":
        case = Case(BELT, gain=gain, integral_time_s=draw(st.sampled_from([1.0, 0.02])), delay_ticks=ticks)
        reduced = BELT[0] * BELT[1] * 0.019**2 / (BELT[0] + BELT[1] * 0.019**2)
        omega = 2 * np.pi * hz
        belt = np.array([*BELT[:2], reduced * omega**2 / 0.019**2, 2 * damping * reduced * omega / 0.019**2])
        value = parameters(belt * factors).value
        value[:, -1] = draw(st.sampled_from([0.0, 3e-4, -1e-4]))
        value[:, 4:6] = draw(st.sampled_from([0.0, 0.0, 0.05, 1.0])) * np.array([1.0, 100.0])
        fits = fits_of(case.open.plant, value, covariance_of(value, 4, seed))
        return case.open, replace(case.open, plant=NumpyTwoMass(radius_m=0.019)), fits
    output = "position" if position else "velocity"
    control = PID(gain=gain * (10.0 if position else 1.0), rate_hz=RATE_HZ, delay_ticks=ticks, derivative_time_s=0.05)
    one, other = (Rigid, NumpyRigid) if kind == "rigid" else (TwoMassGain, NumpyGain)
    values = [0.005, 0.0, 0.0] if kind == "rigid" else [200.0, 0.7 * hz, hz, damping, damping, 2e-4]
    value = np.array(values) * factors
    fits = fits_of(one(), value, covariance_of(value, 1 if kind == "rigid" else 6, seed))
    native, numpy_ = (OpenLoop(of(output=output), Loop(feedback=control), RATE_HZ) for of in (one, other))
    return native, numpy_, fits


@settings(max_examples=30, deadline=None)
@given(loops())
def test_margins_are_those_of_numpy(case: tuple[OpenLoop, OpenLoop, Parameters]) -> None:
    native, numpy_, fits = case
    assert native.native is not None
    assert numpy_.native is None
    found, expected = (margins(fits, loop, BAND_HZ) for loop in (native, numpy_))
    assert found.status.tolist() == expected.status.tolist()
    assert found.place.tolist() == expected.place.tolist()
    assert found.value == pytest.approx(expected.value, rel=1e-7, abs=1e-9, nan_ok=True)
    # At an extremum a search ends within 1e-7 of the frequency, and slopes are differences.
    assert found.frequency_hz == pytest.approx(expected.frequency_hz, rel=1e-5, nan_ok=True)
    assert found.sigma == pytest.approx(expected.sigma, rel=1e-3, abs=1e-9, nan_ok=True)
    assert found.frequency_sigma_hz == pytest.approx(expected.frequency_sigma_hz, rel=1e-2, abs=1e-5, nan_ok=True)


def test_rows_do_not_depend_on_those_beside_them() -> None:
    belts = BELT * np.linspace(0.6, 1.6, 12)[:, np.newaxis]
    fits, loop = parameters(belts, np.array([np.diag((0.01 * belt) ** 2) for belt in belts])), Case(BELT, gain=0.6).open
    together = margins(fits, loop, BAND_HZ)
    for i in range(12):
        alone = margins(fits[i : i + 1], Case(BELT, gain=0.6).open, BAND_HZ)
        assert alone.equals(together[i : i + 1])


def test_a_feedback_with_steps_is_read_by_numpy() -> None:
    assert series_of(lambda f: np.round(f).astype(complex), 0.1, 2000.0) is None
