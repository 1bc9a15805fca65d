"""Validation of a fitted model at the lines of another run, where a simulation in time cannot judge it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np

from livebode.analysis import averaged, fit_averaged, fit_poles
from livebode.arrays import Complex, Floats
from livebode.configuration import FitSection
from livebode.core import FitError, GridError, Response, SignalError, needing, same_rate
from livebode.dataclass import dataclass
from livebode.fitting import POLE_MODELS, CommonPoles, EvaluationGrid, Fit, Kind
from livebode.language import Message
from livebode.records import RunRecord
from livebode_control.validation.correlation import SMALL

LineVerdict = Literal["passes", "small error", "fails", "cannot be judged"]

_ALPHA = 0.03
_STEP = 1e-3  # of a parameter's sigma
_LINES_MIN = 2
_DOF_LEAST = 2.5  # so that the variance of a squared residual is finite
_SHOWS = 2.0  # times the scatter by chance: an error that is found nearly always


@dataclass(frozen=True, eq=False)
class FittedModel:
    """A model at any lines, with its parameters and their covariance; see `fitted_model`."""

    name: str
    at: Callable[[Floats, Floats], Complex]
    values: Floats
    covariance: Floats
    band_hz: tuple[float, float]
    rate_hz: float


@dataclass(frozen=True, eq=False)
class LineValidation:
    """Result of the validation of one model at the lines of a response that it was not fitted to.

    Attributes
    ----------
    model, frequency_hz
        Its name, and the lines inside the fitted band, (lines,).
    residual, sigma
        |Ĝ − G| and its standard deviation by noise and by the covariance of the fit, (lines,).
    missed
        Root mean square over the lines of |Ĝ − G| over the larger of |G| and |Ĝ| − 2 sigma, without the part that both
        uncertainties explain. A line counts less the more its uncertainty exceeds a tenth.
    resolution
        Smallest `missed` that would show: from twice the scatter by chance.
    chi2, p
        Σ of squared residuals by both uncertainties, over its degrees of freedom, and the probability that it is as
        large for a true model.
    fit_percent
        100·(1 − the same root mean square with that part).
    reason
        Why the lines were used, as text.
    """

    model: str
    frequency_hz: Floats
    residual: Floats
    sigma: Floats
    missed: float
    resolution: float
    chi2: float
    p: float
    fit_percent: float
    reason: str

    @property
    def verdict(self) -> LineVerdict:
        """The verdict as that of a `Validation`: an error counts as small below a tenth."""
        significant = self.p < _ALPHA
        if significant and self.missed >= SMALL and self.missed >= self.resolution:
            return "fails"
        if self.resolution >= 1 or (significant and self.missed >= SMALL):
            return "cannot be judged"
        return "small error" if significant else "passes"

    @property
    def worst(self) -> tuple[float, float]:
        """Frequency of the line with the largest residual over its standard deviation, and that ratio."""
        ratio = self.residual / self.sigma
        index = int(np.argmax(ratio))
        return float(self.frequency_hz[index]), float(ratio[index])

    @property
    def sentence(self) -> str:
        """The verdict as text, with what was used and why."""
        shows = f"{100 * self.resolution:.2g} %"
        text = {
            "passes": f"the response is that of the model, and an error of {shows} would have been detected",
            "small error": f"the model misses {100 * self.missed:.2g} % of the response, less than a tenth",
            "fails": f"the model misses {100 * self.missed:.2g} % of the response: it is incomplete or belongs to "
            "another machine",
            "cannot be judged": f"only an error of {shows} would show; average longer or increase the excitation",
        }[self.verdict]
        return (
            f"{self.model} {self.verdict}: {text} (fit {self.fit_percent:.1f} % at {len(self.frequency_hz)} lines); "
            f"judged at the lines, because {self.reason}"
        )

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "model": self.model, "verdict": self.verdict, "sentence": self.sentence, "judged_at": "lines",
            "reason": self.reason, "lines": len(self.frequency_hz), "fit_percent": self.fit_percent,
            "reduced_chi2": self.chi2, "p": self.p, "missed": self.missed, "resolution": self.resolution,
            "worst_line_hz": self.worst[0], "worst_line_sigmas": self.worst[1],
        }  # fmt: skip


def fitted_model(of: Fit | CommonPoles) -> FittedModel:
    """A fit as a function of its parameters; of several outputs the first one."""
    if isinstance(of, Fit):

        def physical(values: Floats, frequency_hz: Floats) -> Complex:
            return of.model.at(values, EvaluationGrid(frequency_hz, of.rate_hz, of.hold))

        parameters = of.parameters
        return FittedModel(
            of.model.name, physical, parameters.value[0], parameters.covariance[0], of.band_hz, of.rate_hz
        )
    f = of.grid.frequency_hz
    band = (float(f[0]), float(f[-1]))
    return FittedModel(of.model, of.moved, of.raw, of.raw_covariance, band, of.grid.rate_hz)


def validate_at_lines(model: FittedModel, response: Response, *, reason: str) -> LineValidation:
    """Compare a model with a response of another record, at its lines inside the band of the fit.

    The residual's covariance is that of the response, independent at each line, and J·P·Jᵀ of the parameters. Their
    sum of squares is compared with that of a true model; a sigma with few degrees of freedom widens it (the squared
    residual of a line then follows F(2, 2d), and their sum a gamma distribution of the same mean and variance).

    Raises
    ------
    SignalError
        If the rates differ, or there are fewer than two such lines with a known sigma.
    """
    lines = response.lines
    if not same_rate(lines.rate_hz, model.rate_hz):
        raise SignalError(
            "rate-differs",
            f"the model was fitted at {model.rate_hz:g} Hz, and the response has {lines.rate_hz:g} Hz",
            "record at the rate of the model",
            rate_hz=lines.rate_hz,
            fit_rate_hz=model.rate_hz,
        )
    low, high = model.band_hz
    f = lines.frequency_hz
    use = response.valid & (response.sigma > 0) & (f >= low * (1 - 1e-9)) & (f <= high * (1 + 1e-9))
    if np.count_nonzero(use) < _LINES_MIN:
        raise SignalError(
            "too-few-lines",
            f"the response has {np.count_nonzero(use)} valid lines with a known sigma in the band of the fit, "
            f"{low:g} … {high:g} Hz",
            "track it at the lines of the model's run, over several periods",
            lines=int(np.count_nonzero(use)),
        )
    f, value, sigma = f[use], response.value[use], response.sigma[use]
    residual = value - model.at(model.values, f)
    slope = _slopes(model, f)
    of_fit = slope @ model.covariance @ slope.T
    whole = np.diag(np.tile(sigma**2 / 2, 2)) + of_fit
    stacked = np.concatenate([residual.real, residual.imag])
    half = float(stacked @ np.linalg.solve(whole, stacked)) / 2
    total = np.sqrt(np.diag(whole)[: f.size] + np.diag(whole)[f.size :])
    larger = np.maximum(np.abs(value) - 2 * sigma, np.abs(value - residual))
    relative, size = (total / larger) ** 2, np.abs(residual / larger) ** 2
    share = 1 / (relative + SMALL**2)
    share /= np.sum(share)
    return LineValidation(
        model=model.name,
        frequency_hz=f,
        residual=np.abs(residual),
        sigma=total,
        missed=float(np.sqrt(max(float(share @ (size - relative)), 0.0))),
        resolution=float(np.sqrt(_SHOWS * float(np.linalg.norm(share * relative)))),
        chi2=half / f.size,
        p=_probability(half, f.size, float(response.dof)),
        fit_percent=100 * (1 - float(np.sqrt(share @ size))),
        reason=reason,
    )


def _slopes(model: FittedModel, f: Floats) -> Floats:
    """Real above imaginary parts of the derivatives by the parameters, (2·lines, parameters)."""
    sigma = np.sqrt(np.maximum(np.diag(model.covariance), 0.0))
    slopes = np.zeros((2 * f.size, sigma.size))
    for i in np.flatnonzero(sigma > 0):
        step = _STEP * sigma[i] * np.eye(sigma.size)[i]
        change = (model.at(model.values + step, f) - model.at(model.values - step, f)) / (2 * _STEP * sigma[i])
        slopes[:, i] = np.concatenate([change.real, change.imag])
    return slopes


def _probability(half: float, lines: int, dof: float) -> float:
    """That Σ|e|²/sigma² over the lines is at least `half`."""
    with needing("SciPy", "analysis", "a validation"):
        from scipy.special import gammaincc

    d = max(dof, _DOF_LEAST) if np.isfinite(dof) else np.inf
    mean, variance = (1.0, 1.0) if np.isinf(d) else (d / (d - 1), d**3 / ((d - 1) ** 2 * (d - 2)))
    return float(gammaincc(lines * mean**2 / variance, half * mean / variance))


def validate_run_at_lines(
    directory: Path,
    other: Path,
    sections: list[tuple[FitSection, str]],
    drifting: dict[str, str],
    entry: str | None = None,
) -> tuple[list[LineValidation], list[str]]:
    """One verdict for the model of each section of a run, with the reason for judging it at lines, and remarks.

    Of matrix runs, those of one `entry` are compared. A section without a reason is judged if its model is in
    `drifting`, models by name with their reasons.

    Raises
    ------
    GridError
        If the runs have different quantities or units.
    FitError
        If no model could be fitted.
    SignalError
        If the other run has no usable lines.
    """
    runs = [RunRecord.open(path, entry=entry) for path in (directory, other)]
    for attribute in ("quantity", "unit"):
        first, second = (run.found.get(attribute, "") for run in runs)
        if first != second:
            raise GridError(
                "not-alike",
                f"{directory.name!r} has the {attribute} {first!r} and {other.name!r} {second!r}",
                "validate on a run of the same input and output",
                what=attribute,
                values=[first, second],
            )
    average, response = averaged(runs[0]), averaged(runs[1]).response
    fits: list[tuple[Fit | CommonPoles, str]] = []
    for section, reason in sections:
        if section.model in POLE_MODELS:
            fits.append((fit_poles(runs[:1], cast(Kind, section.model), section)[0], reason))
        else:
            fits.append((fit_averaged(average, section)[0], reason))
    with_reasons = [(fit, reason or drifting.get(_name(fit), "")) for fit, reason in fits if fit.status == "ok"]
    judged = [validate_at_lines(fitted_model(fit), response, reason=why) for fit, why in with_reasons if why]
    refused: list[str] = [
        Message("{model} was not fitted: {why}", model=_name(fit), why=fit.sentence)
        for fit, _ in fits
        if fit.status != "ok"
    ]
    if not judged:
        raise FitError(
            "not-fitted",
            "; ".join(refused),
            "set fit.output, or fit another model",
            models=[_name(fit) for fit, _ in fits],
        )
    return judged, refused


def _name(fit: Fit | CommonPoles) -> str:
    return fit.model if isinstance(fit, CommonPoles) else fit.model.name
