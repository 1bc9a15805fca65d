"""The errors of one peer against the truth, over all judged moments of all recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from studies.peers import two_mass
from studies.peers.estimates import Estimates
from studies.peers.recording import LINES, RATE_HZ, Recording


@dataclass(frozen=True)
class Score:
    """Root mean squares: of |G| in dB, of Keff and Js in %; these are NaN where the truth is not two masses."""

    magnitude_db: float
    stiffness_percent: float
    inertia_percent: float


def score(recordings: Sequence[Recording], answers: Sequence[Estimates]) -> Score:
    parts = [_errors(recording, answer.at(recording.judged)) for recording, answer in zip(recordings, answers)]
    decibel, parameters = (np.concatenate(part) for part in zip(*parts))
    inertia, _, stiffness, _ = 100 * _rms(parameters)
    return Score(float(_rms(decibel.ravel())), float(stiffness), float(inertia))


def _rms(error: np.ndarray) -> np.ndarray:
    return np.sqrt(np.mean(error**2, axis=0))


def _errors(recording: Recording, answer: Estimates) -> tuple[np.ndarray, np.ndarray]:
    """Of |G| in dB, shape (rows, lines), and relative ones of the four parameters, shape (rows, 4)."""
    moment = answer.sample - answer.delay
    decibel = 20 * np.log10(np.abs(answer.value / recording.true_response(moment)))
    if not recording.case.two_masses:
        return decibel, np.full((len(moment), 4), np.nan)
    found = answer.parameters
    if found is None:
        found = two_mass.fit(answer.value, LINES.frequency_hz, RATE_HZ)
    return decibel, found / recording.true_parameters(moment) - 1
