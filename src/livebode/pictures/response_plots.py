"""`plot` of responses and matrices: which curves they are, and on what they are drawn."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np

from livebode.core import MatrixResponses, PlotKind, Response, Responses, UsageError, needing
from livebode.pictures.curves import Cloud, Curve
from livebode.pictures.plots import draw_bode, draw_nichols, draw_nyquist


def plot_responses(
    responses: Responses, kind: PlotKind, *, axes: Any, c: float | None, label: str | None, color: Any,
    front: Response | None = None,
) -> Any:  # fmt: skip
    """For `FrequencyResponse.plot`; `front` is drawn instead of the newest response, and `c` None draws no bound."""
    if kind not in get_args(PlotKind):
        raise UsageError(
            "not-one-of",
            f"{kind!r} is not a kind of plot",
            f"choose {', '.join(get_args(PlotKind))}",
            argument="kind",
            value=kind,
            allowed=list(get_args(PlotKind)),
        )
    panels = _panels(kind, axes)
    response = front or responses.newest()
    if response is not None:
        _draw(kind, panels, responses, response, _curve(response, c, label, color))
    _labels(kind, panels, responses)
    if axes is None and response is not None:
        panels[0].legend(frameon=False, fontsize="small")
    return panels if kind == "bode" else panels[0]


def _panels(kind: PlotKind, axes: Any) -> Any:
    """The axes as an array of two or one; a new figure of pyplot by default, as pandas and xarray do."""
    count = 2 if kind == "bode" else 1
    if axes is None:
        with needing("Matplotlib", "plots", "a picture"):
            from matplotlib import pyplot

        ratios = {"height_ratios": [3, 2]} if count == 2 else {}
        _, panels = pyplot.subplots(
            count, 1, sharex=True, squeeze=False, gridspec_kw=ratios, layout="constrained", figsize=(7.0, 5.2)
        )
        return panels[:, 0]
    given = np.atleast_1d(np.asarray(axes, dtype=object)).ravel()
    if len(given) != count or not all(hasattr(panel, "plot") for panel in given):
        raise UsageError(
            "wrong-shape",
            f"a {kind} plot needs {'two axes, of magnitude and phase' if count == 2 else 'one axes'}, "
            f"and these are {len(given)}",
            f"give those of plt.subplots({count}), or none for a new figure",
            argument="axes",
            value=len(given),
        )
    return given


def _curve(response: Response, c: float | None, label: str | None, color: Any) -> Curve:
    use = response.valid & np.isfinite(response.value) & (response.value != 0)
    # Also without a drawn bound: the phase of a line that may be zero follows the other lines.
    radius = response.bound(2.0 if c is None else c)
    words = "" if c is None else f"bound: {100 * -np.expm1(-(c**2)):.1f} % ({c:g}σ)"
    value = np.where(use, response.value, np.nan)
    return Curve(response.frequency_hz, value, np.where(use, radius, np.nan), label or response.quantity, words, color)


def _draw(kind: PlotKind, panels: Any, responses: Responses, response: Response, curve: Curve) -> None:
    use = responses.valid & np.isfinite(responses.value) & (responses.value != 0)
    rows = use.any(axis=1)
    cloud = Cloud(np.where(use, responses.value, np.nan)[rows]) if np.count_nonzero(rows) > 1 else None
    if kind == "bode":
        draw_bode(panels[0], panels[1], curve, cloud)
        return
    draw = draw_nyquist if kind == "nyquist" else draw_nichols
    draw(panels[0], curve, cloud, critical=response.quantity == "open loop")


def _labels(kind: PlotKind, panels: Any, responses: Responses) -> None:
    unit = responses.unit
    if kind == "nyquist":
        panels[0].set_xlabel(f"real part in {unit}" if unit else "real part")
        panels[0].set_ylabel(f"imaginary part in {unit}" if unit else "imaginary part")
    else:
        panels[0].set_ylabel(f"magnitude in dB re 1 {unit}" if unit else "magnitude in dB")


def plot_matrix(responses: MatrixResponses, *, axes: Any, c: float | None, label: str | None, color: Any) -> Any:
    """For `MatrixResponses.plot`; `c` None draws no bound."""
    shape = 2 * len(responses.outputs), len(responses.inputs)
    panels = _new_matrix(*shape) if axes is None else np.asarray(axes, dtype=object)
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


def _new_matrix(rows: int, columns: int) -> Any:
    with needing("Matplotlib", "plots", "a picture"):
        from matplotlib import pyplot

    ratios = {"height_ratios": [3, 2] * (rows // 2)}
    size = (2.0 + 3.4 * columns, 1.0 + 1.5 * rows)
    _, panels = pyplot.subplots(
        rows, columns, sharex=True, sharey="row", squeeze=False, gridspec_kw=ratios, layout="constrained", figsize=size
    )
    return panels


def _outer_labels(panels: Any) -> None:
    """Labels at the left and at the bottom only."""
    for inner in panels[:, 1:].ravel():
        inner.set_ylabel("")
    for upper in panels[:-1].ravel():
        upper.set_xlabel("")
