"""The samples of a recording, of a configuration, or behind a run, for results that need no excitation."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from livebode.configuration import Axis, recorded_configuration
from livebode.core import Block, Lines, RecordError, UsageError
from livebode.dataclass import dataclass
from livebode.locations import Location
from livebode.motion import OutputKind
from livebode.records import RunRecord
from livebode.sources import Log, open_log
from livebode_control.clean_stretch import clean_stretch

ChoosePart = Callable[[Axis | None, Log], Log]
"""The part to use of a recording, of which the configuration is known or not."""


@dataclass(frozen=True, eq=False)
class MotionSamples:
    """Samples without gaps, and the channels of the input, of the motion and, if named, of the motor's angle.

    `recorded` is the number of samples of the recording; `run` is the directory of a run, if it was named. `settings`
    are the sections of its configuration, or of the configuration.
    """

    block: Block
    input: str
    output: str
    kind: OutputKind
    recorded: int
    run: Path | None
    settings: dict[str, Any]
    angle: str | None = None

    @property
    def lines_hz(self) -> NDArray[np.float64] | None:
        """Lines of the excitation in the configuration; None where they are found in the recording."""
        section = self.settings.get("lines", {})
        if section.get("frequencies", "auto") == "auto" or section.get("window", "auto") == "auto":
            return None
        return Lines.parse(section["frequencies"], self.block.rate_hz, section["window"]).frequency_hz


def read_strokes(
    target: Location,
    *,
    input: str | None = None,
    position: str | None = None,
    velocity: str | None = None,
    angle: str | None = None,
    rate_hz: float | None = None,
    time: str | None = None,
    part: ChoosePart | None = None,
) -> MotionSamples:
    """The longest stretch without gaps of a recording, or of that of a configuration or a run.

    The channels and the reading are those of the configuration or the run, unless they are given here. `part` chooses
    the part of the recording; default: all of it.

    Raises
    ------
    UsageError
        If a channel is not known, or it is not known whether the output is a position or a velocity, or the part has no
        samples.
    RecordError
        If the run is not from a recording.
    RecordingError, SignalError
        If the recording cannot be read, or has no stretch without gaps.
    """
    log, axis, run = _configured(target)
    settings: dict[str, Any] = {} if axis is None else axis.model_dump(exclude_none=True, by_alias=True)
    torque = input or (None if axis is None else axis.signals.input)
    if torque is None:
        raise _missing("input", "the torque, force or current that moves the axis")
    if position and velocity:
        raise UsageError(
            "conflict",
            "a position and a velocity are given, and one of them is enough",
            "give the one that is measured best",
            options=["position", "velocity"],
        )
    output = position or velocity or (None if axis is None else axis.signals.output)
    if output is None:
        raise _missing("position", "the position or the velocity of the axis")
    turned = angle or settings.get("orders", {}).get("angle")
    source = settings.get("source", {})
    opened = open_log(
        log,
        rate_hz=rate_hz or source.get("rate_hz"),
        time=time or source.get("time"),
        kinds=source.get("kinds"),
        units=source.get("units"),
        dbc=source.get("dbc"),
        channels=[output],
    )
    if part is not None:
        opened = part(axis, opened)
    block, recorded = clean_stretch(opened, [name for name in dict.fromkeys([torque, output, turned]) if name])
    given: Literal["position", "velocity"] | None = "position" if position else "velocity" if velocity else None
    kind = given or _kind(block, output)
    return MotionSamples(block, torque, output, kind, recorded, run, settings, turned)


def _configured(target: Location) -> tuple[Location, Axis | None, Path | None]:
    """The recording, the configuration, and the directory of the run."""
    if isinstance(target, Path) and target.is_dir():
        axis = _recorded_axis(target)
        run = target
    elif target.suffix.lower() == ".toml" and isinstance(target, Path):
        axis, run = Axis.read(target), None
    else:
        return target, None, None
    logs = axis.source.logs
    if len(logs) != 1:
        raise UsageError(
            "conflict",
            f"{target.name} has {len(logs)} recordings, and one is needed",
            "name a recording",
            value=len(logs),
        )
    return logs[0], axis, run


def _recorded_axis(run: Path) -> Axis:
    words = recorded_configuration(RunRecord.open(run, output_only=True, matrix=True).summary)
    kept: dict[str, Any] = {key: words[key] for key in ("source", "signals", "lines", "orders") if key in words}
    if "signals" not in kept or "log" not in kept.get("source", {}):
        raise RecordError(
            "not-tracked",
            f"{str(run)!r} was not computed from a recording, and a run does not contain the samples",
            "name a recording of the axis",
            path=str(run),
        )
    return Axis.of(kept, str(run))


def _missing(argument: str, name: str) -> UsageError:
    return UsageError(
        "missing",
        f"{name} is not known",
        f"name its channel by {argument}, or name a configuration or a run",
        argument=argument,
    )


def _kind(block: Block, output: str) -> OutputKind:
    kind = block.channels[block.index(output)].stated_kind
    if kind not in ("position", "velocity"):
        raise UsageError(
            "missing",
            f"the unit of {output!r} does not show whether it is a position or a velocity",
            "name the channel by position or by velocity",
            argument="position",
            value=output,
        )
    return kind
