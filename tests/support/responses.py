"""Responses with everything that a run may hold: lines that are not valid, unknown sigma, no schedule, odd units."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from hypothesis import strategies as st

from livebode.core import Lines, Responses

ARRAYS = ("value", "sigma", "dof", "coherence", "valid", "first", "sample", "time_s", "schedule")
UNITS = ("", "rad/s/A", "µm/(N m)", 'a,b "c"')


def as_recorded(responses: Responses) -> Responses:
    """The responses as the run of a recording has them: what describes their accuracy has 7 digits."""
    names = "sigma", "coherence", "input_coherence", "distortion", "variation"
    rounded = {name: getattr(responses, name).astype(np.float32).astype(np.float64) for name in names}
    return replace(responses, **rounded, weight=responses.weight.astype(np.complex64).astype(np.complex128))


def made(
    rows: int, lines: Lines, *, hop: int = 20, seed: int = 0, hole: float = 0.3, unit: str = "rad/s/A"
) -> Responses:
    """Random responses, a share `hole` of whose lines is not valid, one every `hop` samples."""
    rng = np.random.default_rng(seed)
    shape = rows, len(lines)
    valid = rng.random(shape) >= hole
    known = valid & (rng.random(shape) >= hole / 2)
    # Of many sizes, from 1e-9 to 1e9.
    value = 10 ** rng.uniform(-9, 9, shape) * np.exp(2j * np.pi * rng.random(shape))
    first = hop * np.arange(rows)
    return Responses(
        lines=lines,
        value=np.where(valid, value, complex(np.nan, np.nan)),
        sigma=np.where(known, rng.uniform(0.5, 2, shape), np.nan),
        dof=rng.choice([1.5, 5.0, 9.0, np.inf], rows),
        coherence=np.where(known, rng.random(shape), np.nan),
        valid=valid,
        first=first,
        sample=first + lines.window - 1,
        time_s=(first + lines.window / 2 - 0.5) / lines.rate_hz,
        schedule=rng.random(rows) if seed % 2 else np.full(rows, np.nan),
        unit=unit,
    )


@st.composite
def any_responses(draw: st.DrawFn) -> Responses:
    """Responses of any shape, on lines that are evenly spaced or not."""
    window = draw(st.sampled_from([60, 400, 2047]))
    bins = draw(st.sets(st.integers(1, 29), min_size=1, max_size=8))
    lines = Lines(tuple(bins), window, draw(st.sampled_from([1000.0, 3999.9, 8000.0])))
    rows, seed = draw(st.integers(1, 6)), draw(st.integers(0, 999))
    return made(rows, lines, seed=seed, hole=draw(st.sampled_from([0.0, 0.4, 1.0])), unit=draw(st.sampled_from(UNITS)))


def cut(responses: Responses, *at: int) -> list[Responses]:
    """The same in parts."""
    edges = [0, *sorted(at), len(responses)]
    return [responses[a:b] for a, b in pairwise(edges)]


def assert_same(one: Responses, other: Responses) -> None:
    for name in ARRAYS:
        assert np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True), name
