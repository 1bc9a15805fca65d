"""livebode where a structure is known: responses freed from what motion does to them, and the model that does it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from livebode import Responses, Settings
from livebode.motion import MotionCorrection, MovingModel
from studies.peers import two_mass
from studies.peers.estimates import Estimates
from studies.peers.recording import HOP, LINES, RATE_HZ, Recording
from studies.peers.tracked import CENTRE

SETTINGS = Settings(lines=LINES, output="velocity", input="u", excitation="w", schedule="x", hop=HOP)


def corrected(recording: Recording) -> Estimates:
    """Each window's response, corrected by the model of its stroke."""
    found = Responses.join([responses for responses, _ in _strokes(recording)])
    return Estimates(found.sample, CENTRE, found.value, waits=_waits(recording))


def model(recording: Recording) -> Estimates:
    """The model that a stroke's responses were corrected by, at each window's centre."""
    parts = list(_strokes(recording))
    found = Responses.join([responses for responses, _ in parts])
    known = np.isfinite(found.schedule)[:, np.newaxis]
    parameters = np.concatenate([_parameters(fitted, responses.schedule) for responses, fitted in parts])
    value = two_mass.response(parameters, LINES.frequency_hz, RATE_HZ)
    return Estimates(
        found.sample,
        CENTRE,
        np.where(known, value, np.nan),
        np.where(known, parameters, np.nan),
        waits=_waits(recording),
    )


def _parameters(fitted: MovingModel, position_m: np.ndarray) -> np.ndarray:
    """Js, mL, Keff, bs, shape (positions, 4); somewhere where the position is not known."""
    at = np.where(np.isfinite(position_m), position_m, fitted.low_m)
    masses = [np.full(at.shape, mass) for mass in (fitted.inertia_kg_m2, fitted.load_kg)]
    return np.stack([*masses, fitted.stiffness_at(at), fitted.damping_at(at)], axis=-1)


def _strokes(recording: Recording) -> Iterator[tuple[Responses, MovingModel]]:
    """The responses of each stroke, with its model."""
    block, stroke = recording.block, recording.stroke_samples
    correction = MotionCorrection(SETTINGS, radius_m=two_mass.RADIUS_M, chunk_samples=stroke)
    begin = 0
    for end in range(stroke + LINES.window, len(block), stroke):
        yield correction.process(block.cut(begin, end)), correction.model
        begin = end
    correction.process(block.cut(begin, len(block)))
    yield correction.finish(), correction.model


def _waits(recording: Recording) -> float:
    return float(recording.stroke_samples + LINES.window)
