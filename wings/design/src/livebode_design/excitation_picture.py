"""The picture of an excitation: one period, its lines with their phases, and the histogram of its samples."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from livebode.pictures import FEW_LINES, Style, drawing, heading, new_figure, plain, save, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from livebode.excitation import Waveform
    from livebode_design.design import Design


_CLASSES = 41
_POINTS_MAX = 20_000  # of a period; of a longer one only the extremes are drawn


def save_excitation_picture(design: Design, path: str | PathLike[str], *, dark: bool = False) -> Path:
    """Write the picture as PNG."""
    return save(excitation_figure(design, dark=dark), Path(path), style(dark))


def excitation_figure(design: Design, *, dark: bool = False) -> Figure:
    """One period over time beside the histogram of its samples; below, amplitude and phase of each line.

    Broken lines are the predicted extremes of the torque, motion included, and its limit if one is set.
    """
    look, waveform = style(dark), design.waveform
    with drawing(look):
        figure = new_figure(11.0, 6.6)
        height = figure.get_size_inches()[1]
        grid = figure.add_gridspec(
            3, 2, width_ratios=[4, 1], height_ratios=[4, 2.7, 1.6], left=0.075, right=0.985, top=1 - 1.2 / height,
            bottom=0.55 / height, hspace=0.42, wspace=0.06,
        )  # fmt: skip
        heading(figure, look, f"Excitation: {_kind(waveform)}", _facts(design), 0.075)
        period = figure.add_subplot(grid[0, 0])
        spread = figure.add_subplot(grid[0, 1], sharey=period)
        sizes = figure.add_subplot(grid[1, :])
        phases = figure.add_subplot(grid[2, :], sharex=sizes)
        _period(period, look, waveform)
        _spread(spread, look, waveform)
        _torque(period, spread, look, design)
        _lines(sizes, phases, look, waveform)
        handles, texts = period.get_legend_handles_labels()
        figure.legend(
            handles, texts, loc="upper left", bbox_to_anchor=(0.075, 1 - 0.76 / height), ncols=4, borderpad=0.0,
            borderaxespad=0.0, handlelength=1.8, columnspacing=1.8,
        )  # fmt: skip
    return figure


def _kind(waveform: Waveform) -> str:
    words = [str(waveform.about.get("kind", ""))]
    words += [str(waveform.about[key]) for key in ("phases", "sweep") if key in waveform.about]
    return ", ".join(words)


def _facts(design: Design) -> str:
    waveform, lines = design.waveform, design.waveform.lines
    f = lines.frequency_hz
    many = f"{len(f)} lines from {f[0]:g} to {f[-1]:g} Hz" if len(f) > 1 else f"one line at {f[0]:g} Hz"
    return (
        f"{many} · {lines.window} samples at {lines.rate_hz:g} Hz · peak {waveform.peak:.3g} N m · "
        f"rms {waveform.rms:.3g} N m · crest factor {waveform.crest_factor:.3f}"
    )


def _period(axes: Axes, look: Style, waveform: Waveform) -> None:
    samples, rate_hz = waveform.samples, waveform.lines.rate_hz
    ms = 1000 * np.arange(samples.size + 1) / rate_hz
    held = np.append(samples, samples[-1])  # a drive outputs each sample until the next
    if held.size > _POINTS_MAX:
        each = -(-samples.size // (_POINTS_MAX // 2))
        parts = np.array_split(samples, -(-samples.size // each))
        times = ms[np.cumsum([0, *(part.size for part in parts[:-1])])]
        axes.fill_between(times, [p.min() for p in parts], [p.max() for p in parts], color=look.run, label="excitation")
    else:
        axes.plot(ms, held, drawstyle="steps-post", color=look.run, linewidth=1.2, label="excitation")
    axes.set_xlim(0, ms[-1])
    axes.set_xlabel("time in one period in ms")
    axes.set_ylabel("torque in N m")
    plain(axes)


def _spread(axes: Axes, look: Style, waveform: Waveform) -> None:
    axes.hist(
        waveform.samples, bins=_CLASSES, orientation="horizontal", color=look.run, alpha=0.75,
        weights=np.full(waveform.samples.size, 100 / waveform.samples.size),
    )  # fmt: skip
    axes.set_xlabel("share of samples in %")
    axes.tick_params(labelleft=False)
    plain(axes)


def _torque(period: Axes, spread: Axes, look: Style, design: Design) -> None:
    torque = [peak for peak in design.peaks if peak.quantity == "torque"]
    lowest, highest = min(peak.low for peak in torque), max(peak.high for peak in torque)
    _, limit = design.limits.of("torque")
    for axes in (period, spread):
        for value, label in ((lowest, "predicted torque, motion included"), (highest, None)):
            axes.axhline(value, color=look.newest, linewidth=1.2, dashes=(5, 3), label=label)
        if np.isfinite(limit):
            for value, label in ((-limit, "limit"), (limit, None)):
                axes.axhline(value, color=look.ink, linewidth=1.2, dashes=(1.5, 1.5), label=label)


def _lines(sizes: Axes, phases: Axes, look: Style, waveform: Waveform) -> None:
    lines = waveform.lines
    f, spectrum = lines.frequency_hz, waveform.spectrum[list(lines.bins)]
    few = len(f) <= FEW_LINES
    if few:
        sizes.vlines(f, 0, np.abs(spectrum), color=look.run, linewidth=1.6)
    sizes.plot(f, np.abs(spectrum), "o" if few else "-", markersize=4, linewidth=1.0, color=look.run)
    if lines.quiet and waveform.about.get("kind") == "odd":
        quiet = np.asarray([k for k in lines.quiet if k % 2]) * lines.resolution_hz
        sizes.plot(quiet, np.zeros(quiet.size), "o", markersize=5, markerfacecolor="none", markeredgecolor=look.newest,
                   clip_on=False, zorder=5, label="odd bins without excitation")  # fmt: skip
        sizes.legend(loc="upper right")
    sizes.set_ylim(0, (1.5 if sizes.get_legend() else 1.15) * float(np.max(np.abs(spectrum))))
    sizes.set_ylabel("amplitude in N m")
    sizes.tick_params(labelbottom=False)
    turned = np.degrees(np.angle(spectrum * 1j))  # of sines, as in eq. (6)
    phases.plot(f, turned, "o", markersize=4 if few else 1.5, color=look.run)
    phases.set_ylim(-190, 190)
    phases.set_yticks([-180, -90, 0, 90, 180])
    phases.set_ylabel("phase in °")
    phases.set_xlabel("frequency in Hz")
    for axes in (sizes, phases):
        plain(axes)
        axes.yaxis.set_label_coords(-0.052, 0.5)
