"""What changed between two matrix runs, of all entries together or of the machine that they describe."""

from __future__ import annotations

from livebode.core import FitError, GridError, MatrixResponses
from livebode.simulation import Gantry
from livebode_matrix.change import compare_matrices
from livebode_matrix.gantry_change import compare_gantries


def whole_changes(
    before: MatrixResponses, after: MatrixResponses, gantry: Gantry | None, cart_m: tuple[float, float] | None
) -> tuple[str, ...]:
    """Sentences: which entry changed most, or which part of the gantry; `gantry`, `cart_m` as in `compare_gantries`."""
    try:
        if gantry is None:
            return (f"all entries: {compare_matrices(before, after).sentence}",)
        change = compare_gantries(before, after, gantry, cart_m=cart_m)
        return tuple(f"gantry: {sentence}" for sentence in change.sentences)
    except (FitError, GridError) as error:
        if gantry is not None:
            raise
        return (f"all entries: not compared together: {error}",)
