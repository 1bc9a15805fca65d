"""`livebode tune --shaper`: input shapers for the resonance of a run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from livebode.cli import results_directory
from livebode.core import RecordError, write_whole, writing

if TYPE_CHECKING:
    from livebode_control.tuning.input_shaper import InputShaper, ModeRange


def propose_shaper(
    directory: Path,
    model: str | None,
    mode: str | None,
    tolerance: float,
    axis: Literal["x", "y", "z"],
    *,
    as_json: bool,
) -> None:
    """Write the input shapers for a mode of a run to its directory, and print them.

    Parameters
    ----------
    directory
        Of the run.
    model, mode
        Model of the fit at every place and its mode; None for the default.
    tolerance
        Share of the vibration that may remain.
    axis
        Axis in the text for Klipper.
    as_json
        Print them as JSON.

    Raises
    ------
    RecordError, UsageError
        If the run has no such model or mode, or is a matrix run.
    """
    from livebode.analysis import modes_by_place
    from livebode.records import RunRecord, matrix_unsupported, to_json
    from livebode_control.tuning.input_shaper import ModeRange, chosen, shapers
    from livebode_control.tuning.shaper_text import KLIPPER_KINDS, c_header, klipper_text, structured_text

    run = RunRecord.open(directory, matrix=True)
    if run.is_matrix:
        raise matrix_unsupported(run.place, "an input shaper")
    modes = modes_by_place(directory, model)
    where = ModeRange.of(modes, mode or ("frequency_1" if modes.model == "modal" else "antiresonance"))
    candidates = shapers(where, tolerance)
    best = chosen(candidates, tolerance)
    for_klipper = chosen(tuple(shaper for shaper in candidates if shaper.kind in KLIPPER_KINDS), tolerance)
    rate_hz = run.lines.rate_hz
    into = results_directory(directory)
    with writing(into, RecordError):
        write_whole(into / "shaper.h", c_header(best, rate_hz).encode())
        write_whole(into / "shaper.st", structured_text(best, rate_hz).encode())
        write_whole(into / "shaper.cfg", klipper_text(for_klipper, axis).encode())
    if as_json:
        print(to_json(_plain(where, candidates, best)))
        return
    show_shapers(where, candidates, best, tolerance)
    print(f"\n{into}: shaper.h, shaper.st, shaper.cfg ({for_klipper.kind})")


def _plain(where: ModeRange, candidates: tuple[InputShaper, ...], best: InputShaper) -> dict[str, Any]:
    from dataclasses import asdict

    return {"mode": asdict(where), "chosen": best.kind, "shapers": [asdict(shaper) for shaper in candidates]}


def show_shapers(where: ModeRange, candidates: tuple[InputShaper, ...], best: InputShaper, tolerance: float) -> None:
    """Print the range of the mode, and each shaper with its largest residual vibration."""
    print(
        f"mode from {where.low_hz:.4g} to {where.high_hz:.4g} Hz, damping {where.low_damping:.3g} … "
        f"{where.high_damping:.3g} (95 %, all places)"
    )
    print(f"  {'':10}{'for Hz':>9}{'longer by':>12}{'residual at most':>19}")
    for shaper in candidates:
        print(
            f"  {shaper.kind:10}{shaper.frequency_hz:>9.2f}{1e3 * shaper.duration_s:>9.1f} ms"
            f"{100 * shaper.worst:>17.1f} %" + ("   proposed" if shaper is best else "")
        )
    if best.worst > tolerance:
        print(
            f"no shaper leaves {100 * tolerance:.3g} % or less: the mode differs too much between the places, "
            "or its bounds are too wide"
        )
    print("promised for this mode alone: a mode that the lines do not show still swings")
    pairs = ", ".join(f"{a:.4f} at {1e3 * t:.3f} ms" for a, t in zip(best.amplitudes, best.times_s))
    print(f"{best.kind}: {pairs}")
