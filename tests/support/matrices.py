"""Matrices of responses with everything that a run may hold: invalid columns, unknown noise, correlated errors."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from livebode.core import Lines, MatrixResponses


def matrices(
    rows: int, lines: Lines, outputs: int = 2, inputs: int = 2, *, seed: int = 0, hole: float = 0.0
) -> MatrixResponses:
    """Random matrices, a share `hole` of whose columns is invalid at a line, and whose noise is unknown as often."""
    rng = np.random.default_rng(seed)

    def positive(*shape: int) -> np.ndarray:
        root = (rng.normal(size=shape) + 1j * rng.normal(size=shape)) / 10
        return np.asarray(root @ root.conj().swapaxes(-1, -2))

    shape = rows, len(lines)
    reason = np.where(rng.random((*shape, inputs)) < hole, rng.integers(1, 4, (*shape, inputs)), 0).astype(np.int8)
    size = 10 ** rng.uniform(-3, 3, (*shape, outputs, inputs))
    value = size * np.exp(2j * np.pi * rng.random(size.shape))
    noise, spread = positive(*shape, outputs, outputs), positive(*shape, inputs, inputs)
    noise[rng.random(shape) < hole] = complex(np.nan, np.nan)
    first = 20 * np.arange(rows)
    return MatrixResponses(
        lines,
        tuple(f"velocity{o + 1}" for o in range(outputs)),
        tuple(f"u{i + 1}" for i in range(inputs)),
        value=np.where(reason[:, :, np.newaxis] == 0, value, complex(np.nan, np.nan)),
        noise=noise,
        spread=spread,
        dof=rng.choice([1.5, 5.0, np.inf], rows),
        coherence=rng.random((*shape, outputs)),
        condition=rng.uniform(1, 9, shape),
        reason=reason,
        first=first,
        sample=first + lines.window - 1,
        time_s=(first + lines.window / 2 - 0.5) / lines.rate_hz,
        units=tuple(tuple(f"m/s/{'AV'[i % 2]}" for i in range(inputs)) for _ in range(outputs)) if seed % 2 else (),
        variation=np.where(rng.random(value.shape) < hole, np.nan, size * rng.random(value.shape)),
    )


@st.composite
def any_matrices(draw: st.DrawFn) -> MatrixResponses:
    """Matrices of any shape, on lines that are evenly spaced or not."""
    bins = draw(st.sets(st.integers(1, 29), min_size=1, max_size=6))
    lines = Lines(tuple(bins), draw(st.sampled_from([60, 2047])), draw(st.sampled_from([1000.0, 3999.9])))
    shape = draw(st.integers(1, 3)), draw(st.integers(1, 3))
    seed, hole = draw(st.integers(0, 999)), draw(st.sampled_from([0.0, 0.4, 1.0]))
    return matrices(draw(st.integers(1, 4)), lines, *shape, seed=seed, hole=hole)
