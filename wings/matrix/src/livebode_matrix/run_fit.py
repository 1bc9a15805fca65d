"""Modes of a matrix run."""

from __future__ import annotations

from livebode.configuration import FitSection
from livebode.fitting import Kind, mean_matrix
from livebode.records import RunRecord
from livebode_matrix.modes import MatrixModes, fit_matrix


def fit_matrix_run(
    run: RunRecord, model: Kind, section: FitSection, order: int | None = None
) -> tuple[MatrixModes, list[str]]:
    """Poles common to all entries of a matrix run, and remarks; raises the errors of `fit_matrix`."""
    responses = run.matrix()
    band = None if section.band_hz is None else (section.band_hz[0], section.band_hz[1])
    mean = mean_matrix(responses)
    fit = fit_matrix(responses, model, order=order, band_hz=band, hold=section.hold)
    return fit, [f"fitted to the mean of the matrices that share no window, {mean.dof[0]:.0f} degrees of freedom"]
