"""design: an experiment for a machine, within its limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

from livebode.core import ExtraError
from livebode.plugins import loaded, named


def design(
    experiment: str | PathLike[str] | Mapping[str, Any],
    directory: str | PathLike[str] | None = None,
    *,
    band_hz: tuple[float, float] | None = None,
    resolution_hz: float | None = None,
    amplitude_n_m: float | Sequence[float] | None = None,
    accuracy: float | None = None,
    seed: int | None = None,
) -> Any:
    """Choose lines, window, amplitude and hop for a machine; as `livebode design`.

    Parameters
    ----------
    experiment
        Description of machine, limits and required accuracy: a TOML file as in
        wings/design/docs/excitation.md, or the same as a mapping.
    directory
        New directory for the excitation and axis.toml, in every format; default: nothing is written.
    band_hz, resolution_hz, amplitude_n_m, accuracy, seed
        Replace the key of the same name in [excitation].

    Returns
    -------
    Design
        A `livebode_design.Design`: its `choices` explain it, `waveform` is the excitation, and `peaks` are the
        predicted ones.

    Raises
    ------
    ConfigError
        If the description has an unknown key, or a value that cannot be used.
    DesignError
        If no excitation meets the required accuracy within the limits.
    OutputError
        If the directory exists.
    ExtraError
        If the wing design was left out of the installation.

    Examples
    --------
    >>> machine = {"belt": {"standstill": {"position_m": 0.8}}, "excitation": {}}
    >>> found = design(machine, band_hz=(20, 140), resolution_hz=20)
    >>> found.waveform.lines.frequency_hz
    array([ 30.,  70.,  90., 130.])
    >>> found.waveform.lines.window, found.hop
    (400, 20)
    """
    command = named("commands").get("design")
    if command is None:
        raise ExtraError(
            "not-installed",
            "livebode.design belongs to the wing design of livebode, which was left out of the installation",
            "install the wing design too",
            package="livebode_design",
        )
    given = {
        "band_hz": None if band_hz is None else [float(f) for f in band_hz],
        "resolution_hz": resolution_hz,
        "amplitude_n_m": amplitude_n_m,
        "accuracy": accuracy,
        "seed": seed,
    }
    over = {name: value for name, value in given.items() if value is not None}
    return loaded(command.python)(experiment, None if directory is None else Path(directory), over)
