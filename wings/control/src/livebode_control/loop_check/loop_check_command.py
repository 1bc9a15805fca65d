"""`livebode validate --loop`: the description of a run's loop compared with its signals."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from livebode.cli import results_directory
from livebode.core import UsageError

if TYPE_CHECKING:
    from livebode.configuration import LoopSection
    from livebode_control.loop_check.loop_check import LoopCheck

_LISTED_MAX = 6


def validate_loop(directory: Path, axis: Path | None, channels: dict[str, str | None], *, as_json: bool) -> None:
    """Write loop-check.json of a run to its directory, and print the result.

    Parameters
    ----------
    directory
        Of the run; of a matrix run each of [[loop.controllers]] is compared with its own signals.
    axis
        File with another [loop] than that of the run.
    channels
        Channels by role (excitation, input, output) that replace those of the run.
    as_json
        Print the result as JSON.

    Raises
    ------
    UsageError
        If channels are given for a matrix run, or the loop is not described.
    LivebodeError
        As of `check_loop_of_run`.
    """
    from livebode.configuration import read_loop
    from livebode.records import RunRecord, to_json
    from livebode_control.loop_check.run_loop_check import check_loop_of_run, store_loop_check

    section = None if axis is None else read_loop(axis)
    if RunRecord.open(directory, lambda _: None, matrix=True).is_matrix:
        if any(channels.values()):
            raise _no_channels()
        _check_controllers(directory, section, as_json)
        return
    check, described = check_loop_of_run(directory, section, channels)
    written = store_loop_check(results_directory(directory), check, described)
    if as_json:
        print(to_json(check.plain()))
        return
    show_loop_check(check)
    print(f"\n{written}")


def _check_controllers(directory: Path, section: LoopSection | None, as_json: bool) -> None:
    from livebode.records import to_json
    from livebode_control.loop_check.run_loop_check import check_controllers_of_run, store_controller_checks

    checks, described = check_controllers_of_run(directory, section)
    written = store_controller_checks(results_directory(directory), checks, described)
    if as_json:
        print(to_json({"controllers": {name: check.plain() for name, check in checks.items()}}))
        return
    for name, check in checks.items():
        print(f"controller {name}:")
        show_loop_check(check)
        print()
    print(written)


def _no_channels() -> UsageError:
    return UsageError(
        "conflict",
        "each controller of a matrix run is compared with the channels of its own signals",
        "leave out --output, --input and --excitation",
        options=["--output", "--input", "--excitation"],
    )


def show_loop_check(check: LoopCheck) -> None:
    """Print the verdict, the controller at the lines, and the changes that explain it."""
    import numpy as np

    print(check.sentence)
    residual = check.residual
    ratio, bound = residual.ratio, 1.73 * residual.ratio_sigma
    print(f"\n  controller as measured / as described, with 95 % bounds ({check.windows} windows)")
    print(f"  {'Hz':>8}  {'|ratio|':>9}  {'deg':>8}  {'± %':>8}")
    for f, q, b in zip(residual.frequency_hz, ratio, bound):
        if np.isnan(b):
            print(f"  {f:8.4g}  the output is too weak")
            continue
        mark = "  *" if abs(q - 1) > b else ""
        print(f"  {f:8.4g}  {abs(q):9.5f}  {np.degrees(np.angle(q)):8.3f}  {100 * b:8.2g}{mark}")
    if len(check.explanations) > 1:
        print("\n  changes of the description that cannot be told apart with these lines, the best first:")
        for explanation in check.explanations[:_LISTED_MAX]:
            print(f"    {explanation.sentence}   (p = {explanation.p:.2g})")
        if (more := len(check.explanations) - _LISTED_MAX) > 0:
            print(f"    and {more} more")
    if check.nearest is not None:
        print(f"\n  the nearest single change: {check.nearest.sentence}; more than one word may be wrong")
