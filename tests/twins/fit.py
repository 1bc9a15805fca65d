"""The NumPy twin of the fit: the readable definition of what `livebode.kernel.fit` computes in C, row by row.

The same operations in the same order, so C must agree with it to the bit (except for the sign and payload of NaN). All
arithmetic is real, and exp, log, sin and cos are those of `elementary`, because those of a library, its complex
products and its sums differ between computers. A sum over lines has eight partial sums.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from livebode.kernel import (
    RIGID,
    TWO_MASS,
    TWO_MASS_GAIN,
    FitFound,
    FitModel,
    FitRows,
)
from tests.twins.fit_arithmetic import Complex, Floats, SingularError, total
from tests.twins.fit_model import LinePlaces, respond
from tests.twins.fit_search import ROUNDS, FitSearch, SearchPoint
from tests.twins.fit_weighing import WeighedRow, model_error

FITTED, NO_RESPONSE, NOT_CONVERGED, AT_BOUND, NOT_SEEN, NO_MODEL, FRICTION = range(7)
"""Status of a row: lb_fit_status of livebode/fit.h."""

_FIRST_EPSILON, _SAME, _EPSILON_MAX, _LACKING = 0.1, 0.01, 0.5, 0.03
_UNCERTAIN, _SUSPICIOUS = 0.5, 4.0
_WARM_ROUNDS, _REWEIGHTED, _FRICTION_ROUNDS, _EXPLAINED = 12, 8, 15, 0.5


def fit(model: FitModel, frequency_hz: Floats, rate_hz: float, rows: FitRows) -> FitFound:
    """As `livebode.kernel.fit`."""
    count, lines = rows.value.shape
    found = FitFound.empty(count, lines, model.table.shape[1])
    with np.errstate(all="ignore"):
        places = LinePlaces(frequency_hz, rate_hz)
        for i in range(count):
            row = WeighedRow(rows.value[i], rows.sigma[i], rows.use[i])
            start = None if rows.start is None else rows.start[i]
            epsilon = None if rows.epsilon is None else rows.epsilon[i]
            out = [part[i : i + 1] for part in found]
            _fit_row(FitSearch(model, places, row), rows.noise_dof[i], start, epsilon, out)
    return found


def fit_response(model: FitModel, rate_hz: float, values: Floats, frequency_hz: Floats) -> Complex:
    """As `livebode.kernel.fit_response`."""
    with np.errstate(all="ignore"):
        every = np.broadcast_to(frequency_hz, (len(values), frequency_hz.shape[-1]))
        curves = [respond(LinePlaces(f, rate_hz), model, v) for f, v in zip(every, values)]
    found = np.empty(every.shape, np.complex128)
    for row, curve in zip(found, curves):
        row.real, row.imag = curve
    return found


def fit_epsilon(rest: Floats, noise: Floats, size: Floats, dof: Floats) -> Floats:
    """As `livebode.kernel.fit_epsilon`."""
    with np.errstate(all="ignore"):
        return np.array([model_error(*parts) for parts in zip(rest, noise, size, dof)])


def _fit_row(problem: FitSearch, noise_dof: Any, start: Floats | None, epsilon: Any, out: list[Any]) -> None:
    row = problem.row
    dof = 2.0 * row.count - len(problem.at)
    try:
        if not dof > 0:
            _write_none(out, dof, NO_RESPONSE)
            return
        row.weigh(_FIRST_EPSILON if epsilon is None else epsilon)
        found = _begun(problem, start, dof)
        if epsilon is None:
            found, epsilon = _reweighted(problem, found, dof)
        else:
            row.take_residuals(found.response)
            # A row with a much larger model error than the previous ones is less certain than they were.
            epsilon = row.epsilon(dof) if row.epsilon(_SUSPICIOUS * dof) > epsilon else epsilon
        _write(problem, found, noise_dof, dof, epsilon, out)
    except SingularError:
        _write_none(out, dof, NOT_CONVERGED)


def _begun(problem: FitSearch, start: Floats | None, dof: float) -> SearchPoint:
    """From the start, and where this fails the best fit of a scan."""
    if start is None:
        return problem.scanned()
    found = problem.minimised(start, _WARM_ROUNDS)
    if found.is_settled and not found.cost > _SUSPICIOUS * dof:
        return found
    again = problem.scanned()
    return again if again.cost < found.cost or not found.is_settled else found


def _reweighted(problem: FitSearch, found: SearchPoint, dof: float) -> tuple[SearchPoint, Any]:
    """Fits repeated with the ε of their residuals until it stays."""
    epsilon: Any = _FIRST_EPSILON
    for _ in range(_REWEIGHTED):
        problem.row.take_residuals(found.response)
        now = problem.row.epsilon(dof)
        if abs(now - epsilon) <= _SAME * now:
            break
        epsilon = now
        problem.row.weigh(now)
        found = problem.minimised(found.values, ROUNDS)
    return found, epsilon


def _write_none(out: list[Any], dof: float, status: int) -> None:
    for part in (0, 1, 3, 4, 6, 7):
        out[part][0] = np.nan + 1j * np.nan if part == 6 else np.nan
    out[2][0], out[5][0] = status, dof


def _write(problem: FitSearch, found: SearchPoint, noise_dof: Any, dof: float, epsilon: Any, out: list[Any]) -> None:
    row, at = problem.row, problem.at
    row.take_residuals(found.response)
    row.weigh(epsilon)
    small = problem.covariance(found, noise_dof)
    unseen = not np.isfinite(small).all() or not (np.sqrt(np.diagonal(small)) <= _UNCERTAIN)[problem.is_log[at]].all()
    status = FITTED
    for word, failed in (
        (NO_MODEL, row.reduced(_EPSILON_MAX * _EPSILON_MAX) > dof),
        (NOT_SEEN, unseen),
        (AT_BOUND, problem.is_at_bound(found.values)),
        (NOT_CONVERGED, not found.is_settled),
    ):
        status = word if failed else status
    out[0][0] = found.values if status == FITTED else np.nan
    out[1][0] = 0.0 if status == FITTED else np.nan
    if status == FITTED:
        outward = np.where(problem.is_log, found.values, problem.scale)[at]
        out[1][0][np.ix_(at, at)] = outward[:, np.newaxis] * small * outward
    known = row.noise > 0
    out[2][0], out[3][0] = status, epsilon if status == FITTED else np.nan
    out[4][0] = total(np.where(known, 2.0 * row.rest / row.noise, 0.0)) if known.any() else np.nan
    out[5][0] = dof
    out[6][0].real, out[6][0].imag = found.response
    out[7][0] = found.values
    if status == FITTED and row.reduced(_LACKING * _LACKING) > dof and _explained(problem, found, dof):
        out[2][0] = FRICTION
        for part in (0, 1, 3):
            out[part][0] = np.nan


def _explained(problem: FitSearch, found: SearchPoint, dof: float) -> bool:
    """Whether ε falls to less than half as soon as one viscous friction is fitted too."""
    m, n, row = problem.model, len(problem.held), problem.row
    if m.kind == TWO_MASS_GAIN:
        return False
    epsilon = row.epsilon(dof)
    for at in (1,) if m.kind == RIGID else (n - 3, n - 2):
        arm = m.arm if m.kind == TWO_MASS and at == n - 2 else 1.0
        # A friction that stops the motor in as long as ten of the lowest line's radians take.
        shown = found.values[0] * (2.0 * np.pi * problem.places.lowest_hz / 10.0) / arm
        table, start = m.table.copy(), found.values.copy()
        table[3, at], table[4, at], start[at] = shown, np.nan, shown
        row.take_residuals((np.zeros(len(row.use)), np.zeros(len(row.use))))
        row.size = row.rest
        row.weigh(epsilon / 2.0)
        # The friction is the last of the free parameters.
        wider = FitSearch(m._replace(table=table), problem.places, row, last=at)
        try:
            with_friction = wider.minimised(start, _FRICTION_ROUNDS)
        except SingularError:
            continue
        row.take_residuals(with_friction.response)
        if row.epsilon(dof - 1.0) < _EXPLAINED * epsilon:
            return True
    return False
