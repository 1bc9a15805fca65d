"""The recordings of `livebode example`: simulated axes whose files the documentation uses.

The same files on every call: each recording has a fixed seed.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import field
from importlib import resources
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from livebode.core import Block, Lines, OutputError, remove_empty, whole_directory, whole_files, writing
from livebode.dataclass import dataclass
from livebode.excitation import chirp, multisine
from livebode.export import write_columns, write_header
from livebode.plugins import named
from livebode.simulation import (
    BeltAxis,
    Drive,
    Friction,
    Mechanics,
    Sensor,
    SimulatedAxis,
    Standstill,
    Strokes,
    StrokeSequence,
    TensionLoss,
)
from livebode.tables import Table, write_parquet

_RATE_HZ, _WINDOW = 4000.0, 400
_SENSOR = Sensor(noise_rad_per_s=0.1)
_HELD = Standstill(position_m=0.8)
_STROKES = Strokes(start_m=0.25, end_m=1.6, speed_m_per_s=0.38)
_HUM_HZ, _HUM_N_M = 50.0, 0.05
_SIGNALS = ("w", "u", "velocity")


@dataclass(frozen=True)
class Example:
    """Recordings of one kind, their configurations, and the commands to begin with.

    `recordings` are functions that simulate, by name of their files; `configurations` names of files in the directory
    example_files of `package`; `lakes` functions that write a directory, by its name.
    """

    about: str
    recordings: dict[str, Callable[[], Table]]
    configurations: tuple[str, ...]
    commands: tuple[str, ...]
    lakes: dict[str, Callable[[Path], None]] = field(default_factory=dict)
    package: str = "livebode.interface"

    @property
    def files(self) -> list[str]:
        return [*self.recordings, *self.configurations, *self.lakes]

    @property
    def usable(self) -> bool:
        """Whether the packages that write it are installed."""
        return not self.lakes or all(map(find_spec, ("deltalake", "pyarrow")))


def _simulated(names: tuple[str, ...], **settings: Any) -> Callable[[], Table]:
    def simulate() -> Table:
        block, _ = SimulatedAxis(BeltAxis(sensor=_SENSOR, **settings)).run()
        return table_of(block, names)

    return simulate


def table_of(block: Block, names: tuple[str, ...]) -> Table:
    """Time and these channels, with their units in the names of the columns."""
    units = {channel.name: channel.unit for channel in block.channels}
    columns = {f"{name} [{units[name]}]": block[name] for name in names}
    return Table.of({"t [s]": np.arange(len(block)) / block.rate_hz} | columns)


def _multisine(frequencies: str, amplitude_n_m: float = 1.0) -> np.ndarray:
    return multisine(Lines.parse(frequencies, _RATE_HZ, _WINDOW), amplitude_n_m)


def _standstill(seed: int, seconds: float = 2.0) -> Callable[[], Table]:
    period = _multisine("20:140:10", 0.5)
    return _simulated(_SIGNALS, motion=_HELD, excitation_n_m=period, seconds=seconds, run_in_s=0.5, seed=seed)


def _moving(seed: int, seconds: float, *faults: TensionLoss) -> Callable[[], Table]:
    period = _multisine("20:140:20")
    return _simulated(
        (*_SIGNALS, "x"), motion=_STROKES, excitation_n_m=period, faults=faults, seconds=seconds, seed=seed
    )


def _tuned() -> Table:
    """An axis at standstill, excited from below its bandwidth to beyond its resonance."""
    lines = Lines.parse("4:100:2, 104:400:8", _RATE_HZ, 2000)
    return _simulated(
        _SIGNALS, motion=_HELD, excitation_n_m=multisine(lines, 0.2), seconds=8.0, run_in_s=10.0, seed=10
    )()


def _single_chirp() -> Table:
    period = chirp(10, 200, _RATE_HZ, 3 * int(_RATE_HZ), 2.0)
    return _simulated(_SIGNALS, motion=_HELD, excitation_n_m=period, seconds=3.0, seed=6)()


def _quiet() -> Table:
    """An axis at standstill without excitation; the measured torque has a hum."""
    block, _ = SimulatedAxis(BeltAxis(sensor=_SENSOR, motion=_HELD, seconds=3.0, seed=7)).run()
    table = table_of(block, ("u", "velocity"))
    hum = _HUM_N_M * np.sin(2 * np.pi * _HUM_HZ * np.arange(len(block)) / block.rate_hz)
    return Table.of(dict(zip(table.column_names, table.columns)) | {table.column_names[1]: block["u"] + hum})


def _strokes() -> Table:
    """A stiff axis with friction and cogging in strokes at three speeds."""
    axis = BeltAxis(
        mechanics=Mechanics(stiffness_n_per_m=5e7, damping_n_s_per_m=1000.0, frozen_position_m=0.8),
        motion=StrokeSequence(
            turning_points_m=(0.3, 0.7, 0.3, 0.7, 0.3, 0.7, 0.3), speeds_m_per_s=(0.06, 0.06, 0.12, 0.12, 0.2, 0.2)
        ),
        friction=Friction(
            load_coulomb_n=15.0, load_viscous_n_s_per_m=40.0, load_stribeck_n=10.0, stribeck_speed_m_per_s=0.04,
            smoothing_m_per_s=1e-4,
        ),
        drive=Drive(torque_ripple_n_m=0.05, torque_ripple_per_turn=24, torque_noise_n_m=0.05),
        sensor=Sensor(noise_rad_per_s=0.02),
        seconds=25.5,
        seed=9,
    )  # fmt: skip
    block, _ = SimulatedAxis(axis).run()
    return table_of(block, ("u", "velocity", "position"))


EXAMPLES = {
    "standstill": Example(
        "an axis at standstill, recorded twice",
        {"standstill.csv": _standstill(1), "standstill-2.csv": _standstill(2)},
        ("standstill.toml", "acceptance.toml"),
        (
            "livebode inspect standstill.csv --excitation w --output velocity",
            "livebode run standstill.toml",
            "livebode fit runs/standstill",
            "livebode validate runs/standstill --on standstill-2.csv",
        ),
    ),
    "moving": Example(
        "an axis that moves, with the position as schedule",
        {"moving.parquet": _moving(3, 8.2)},
        ("moving.toml",),
        ("livebode run moving.toml",),
    ),
    "chirp": Example(
        "a single chirp, which does not repeat",
        {"chirp.csv": _single_chirp},
        ("chirp.toml",),
        ("livebode inspect chirp.csv --excitation w", "livebode run chirp.toml"),
    ),
    "fault": Example(
        "a healthy axis on two days, and today with a belt that becomes 2 % softer",
        {
            "monday.parquet": _moving(1, 13.0),
            "tuesday.parquet": _moving(2, 13.0),
            "today.parquet": _moving(3, 13.0, TensionLoss(start_s=5.0, loss=0.02)),
        },
        ("monday.toml", "tuesday.toml", "today.toml"),
        (
            "livebode run monday.toml",
            "livebode run tuesday.toml",
            "livebode learn runs/monday runs/tuesday --out healthy.json",
            "livebode run today.toml --baseline healthy.json --false-alarm-interval 30",
        ),
    ),
    "loop": Example(
        "an axis whose control loop is described",
        {"loop.parquet": _standstill(5)},
        ("loop.toml",),
        ("livebode run loop.toml", "livebode margins runs/loop"),
    ),
    "tune": Example(
        "an axis whose described controllers are checked and tuned",
        {"tune.parquet": _tuned},
        ("tune.toml",),
        ("livebode run tune.toml", "livebode validate runs/tune --loop", "livebode tune runs/tune"),
    ),
    "design": Example(
        "before an experiment: a recording without excitation, and descriptions of two machines",
        {"quiet.parquet": _quiet},
        ("experiment.toml", "several-motors.toml"),
        (
            "livebode inspect quiet.parquet --lines 20:140:10 --window 400 --output velocity --input u",
            "livebode design experiment.toml --out runs/experiment",
            "livebode design several-motors.toml --out runs/several-motors",
        ),
    ),
    "output-only": Example(
        "an axis without a recorded input",
        {
            "ambient.parquet": _simulated(
                ("velocity",), motion=_HELD, drive=Drive(torque_noise_n_m=1.0), seconds=20.0, seed=8
            )
        },
        ("ambient.toml",),
        ("livebode run ambient.toml",),
    ),
    "strokes": Example(
        "an axis with friction and cogging, in strokes without excitation",
        {"strokes.parquet": _strokes},
        ("strokes.toml",),
        ("livebode friction strokes.toml", "livebode orders strokes.toml"),
    ),
}
"""livebode's own examples by name; those of plug-ins are of the same form (the group `examples`)."""


def write_examples(names: list[str], folder: Path, *, force: bool = False) -> list[Path]:
    """Write the recordings and configurations of these examples.

    Parameters
    ----------
    names
        Of examples of the plug-in group `examples`.
    folder
        Created if it is missing.
    force
        Replace files with other content. A file that has this content already is left as it is, and a lake always.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    OutputError
        If one of the files exists with other content, or cannot be written. Nothing is written then.
    """
    examples = named("examples")
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        with whole_files(folder, "example") as partial:
            for name in names:
                _write(examples[name], partial)
            files = [folder / path.name for path in sorted(partial.iterdir())]
            for path in files:
                _check(path, partial / path.name, force)
        for name in names:
            files += [_lake(folder / own, write) for own, write in examples[name].lakes.items()]
    return files


def _lake(path: Path, write: Callable[[Path], None]) -> Path:
    """Write a lake; one that is there already is left as it is, because others may have written to it."""
    if os.path.lexists(path):
        if not (path / "tables" / "runs" / "_delta_log").is_dir():
            raise OutputError(
                "exists",
                f"{str(path)!r} exists already, and is not a lake",
                "choose another directory",
                path=str(path),
            )
        return path
    with whole_directory(path, remove_empty) as partial:
        write(partial)
    return path


def _write(example: Example, folder: Path) -> None:
    for name, simulate in example.recordings.items():
        if name.endswith(".csv"):
            _write_csv(folder / name, simulate())
        else:
            write_parquet(folder / name, simulate())
    for name in example.configurations:
        text = (resources.files(example.package) / "example_files" / name).read_text("utf-8")
        (folder / name).write_text(text, encoding="utf-8", newline="\n")


def _write_csv(path: Path, table: Table) -> None:
    with path.open("wb") as file:
        write_header(file, table.column_names)
        write_columns(file, [table[name] for name in table.column_names])


def _check(path: Path, written: Path, force: bool) -> None:
    """An OutputError if something else is there."""
    if path.is_dir() or (not force and path.exists() and path.read_bytes() != written.read_bytes()):
        raise _exists(path)


def _exists(path: Path) -> OutputError:
    return OutputError(
        "exists",
        f"{str(path)!r} exists already, and is not the file of the example",
        "choose another directory, or replace it with force",
        path=str(path),
        argument="force",
    )
