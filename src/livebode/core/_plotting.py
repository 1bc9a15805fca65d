"""Responses on axes: which curves they are, and on what they are drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, get_args

import numpy as np

from livebode.core._kinds import PlotKind
from livebode.core.errors import UsageError
from livebode.core.optional_packages import needing
from livebode.drawing import Cloud, Curve

if TYPE_CHECKING:
    from livebode.core._response import Response, Responses


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
    one = front or responses.newest()
    if one is not None:
        _draw(kind, panels, responses, one, _curve(one, c, label, color))
    _labels(kind, panels, responses)
    if axes is None and one is not None:
        panels[0].legend(frameon=False, fontsize="small")
    return panels if kind == "bode" else panels[0]


def _panels(kind: PlotKind, axes: Any) -> Any:
    """The axes as an array of two or one; a new figure of pyplot by default, as pandas and xarray do."""
    count = 2 if kind == "bode" else 1
    if axes is None:
        with needing("Matplotlib", "plots", "a picture"):
            from matplotlib import pyplot

        ratios = {"height_ratios": [3, 2]} if count == 2 else {}
        _, found = pyplot.subplots(
            count, 1, sharex=True, squeeze=False, gridspec_kw=ratios, layout="constrained", figsize=(7.0, 5.2)
        )
        return found[:, 0]
    given = np.atleast_1d(np.asarray(axes, dtype=object)).ravel()
    if len(given) != count or not all(hasattr(one, "plot") for one in given):
        raise UsageError(
            "wrong-shape",
            f"a {kind} plot needs {'two axes, of magnitude and phase' if count == 2 else 'one axes'}, "
            f"and these are {len(given)}",
            f"give those of plt.subplots({count}), or none for a new figure",
            argument="axes",
            value=len(given),
        )
    return given


def _curve(one: Response, c: float | None, label: str | None, color: Any) -> Curve:
    use = one.valid & np.isfinite(one.value) & (one.value != 0)
    # Also without a drawn bound: the phase of a line that may be zero follows the other lines.
    radius = one.bound(2.0 if c is None else c)
    words = "" if c is None else f"bound: {100 * -np.expm1(-(c**2)):.1f} % ({c:g}σ)"
    value = np.where(use, one.value, np.nan)
    return Curve(one.frequency_hz, value, np.where(use, radius, np.nan), label or one.quantity, words, color)


def _draw(kind: PlotKind, panels: Any, responses: Responses, one: Response, curve: Curve) -> None:
    use = responses.valid & np.isfinite(responses.value) & (responses.value != 0)
    rows = use.any(axis=1)
    cloud = Cloud(np.where(use, responses.value, np.nan)[rows]) if np.count_nonzero(rows) > 1 else None
    if kind == "bode":
        from livebode.drawing import draw_bode

        draw_bode(panels[0], panels[1], curve, cloud)
        return
    from livebode.drawing import draw_nichols, draw_nyquist

    draw = draw_nyquist if kind == "nyquist" else draw_nichols
    draw(panels[0], curve, cloud, critical=one.quantity == "open loop")


def _labels(kind: PlotKind, panels: Any, responses: Responses) -> None:
    unit = responses.unit
    if kind == "nyquist":
        panels[0].set_xlabel(f"real part in {unit}" if unit else "real part")
        panels[0].set_ylabel(f"imaginary part in {unit}" if unit else "imaginary part")
    else:
        panels[0].set_ylabel(f"magnitude in dB re 1 {unit}" if unit else "magnitude in dB")
