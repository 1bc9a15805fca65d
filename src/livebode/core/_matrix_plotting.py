"""A matrix of Bode plots on axes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from livebode.core._plotting import plot_responses
from livebode.core.errors import UsageError
from livebode.core.optional_packages import needing

if TYPE_CHECKING:
    from livebode.core._matrix_responses import MatrixResponses


def plot_matrix(responses: MatrixResponses, *, axes: Any, c: float | None, label: str | None, color: Any) -> Any:
    """For `MatrixResponses.plot`; `c` None draws no bound."""
    shape = 2 * len(responses.outputs), len(responses.inputs)
    panels = _new(*shape) if axes is None else np.asarray(axes, dtype=object)
    if panels.shape != shape:
        raise UsageError(
            "wrong-shape",
            f"{shape[0] // 2} outputs and {shape[1]} inputs need axes of shape {shape}, and these have {panels.shape}",
            f"give those of plt.subplots({shape[0]}, {shape[1]}, squeeze=False), or none for a new figure",
            argument="axes",
            value=list(panels.shape),
        )
    for o, output in enumerate(responses.outputs):
        for i, input in enumerate(responses.inputs):
            pair = panels[2 * o : 2 * o + 2, i]
            plot_responses(responses.entry(o, i), "bode", axes=pair, c=c, label=label, color=color)
            pair[0].set_title(f"{input} → {output}", fontsize="medium")
    _outer_labels(panels)
    return panels


def _new(rows: int, columns: int) -> Any:
    with needing("Matplotlib", "plots", "a picture"):
        from matplotlib import pyplot

    ratios = {"height_ratios": [3, 2] * (rows // 2)}
    size = (2.0 + 3.4 * columns, 1.0 + 1.5 * rows)
    _, found = pyplot.subplots(
        rows, columns, sharex=True, sharey="row", squeeze=False, gridspec_kw=ratios, layout="constrained", figsize=size
    )
    return found


def _outer_labels(panels: Any) -> None:
    """Labels at the left and at the bottom only."""
    for inner in panels[:, 1:].ravel():
        inner.set_ylabel("")
    for upper in panels[:-1].ravel():
        upper.set_xlabel("")
