"""The axis of an experiment from a measured run: its machine, and what it uses of the run's configuration."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from livebode.analysis import mean_of
from livebode.configuration import LoopSection, recorded_configuration
from livebode.core import ConfigError, split_plant_unit
from livebode.records import RunRecord
from livebode_design.machine import MOTION_KEYS, Machine
from livebode_design.measured_plant import MeasuredResponse, Output, measured_machine

Number = Annotated[float, Field(strict=True)]  # true is not a number

_KEPT = ("differenced", "spikes")  # of the run's [tracking]: properties of the recording, not of the evaluation
_UNCHECKED = "the loop is not that of the run: its stability is not checked"


class MeasuredSection(BaseModel):
    """[measured]: a plant that a run measured, and the extremes of its motion alone.

    Parameters
    ----------
    run
        Directory of the run, relative to this file: the mean response of the plant. Its loop, signal names and
        differenced channels are used also.
    output
        What the output of the run is. Default: by its kind, otherwise by its loop.
    radius_m
        Metres of travel per radian; of a rotary axis the metres are radians.
    noise
        Standard deviation of white noise on the output, in its unit; 0: not known.
    encoder_counts_per_turn
        Counts of the encoder per turn of the motor; 0: not known.
    stroke_s
        Seconds in which the motion passes each place once. Default: the axis is at standstill.
    torque_n_m
        Lowest and highest torque in the motion alone, in N m. Default: not known; 0 at standstill.
    speed_m_per_s
        Lowest and highest speed in the motion alone, in m/s. Default: not known; 0 at standstill.
    position_m
        Lowest and highest position in the motion alone, in metres. Default: not known.
    following_error_m
        Lowest and highest following error in the motion alone, in metres. Default: not known; 0 at standstill.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    run: Path
    output: Output | None = None
    radius_m: Number = 1.0
    noise: Number = 0.0
    encoder_counts_per_turn: Annotated[int, Field(strict=True, ge=0)] = 0
    stroke_s: Number | None = None
    torque_n_m: tuple[Number, Number] | None = None
    speed_m_per_s: tuple[Number, Number] | None = None
    position_m: tuple[Number, Number] | None = None
    following_error_m: tuple[Number, Number] | None = None


class MeasuredAxis:
    """A run's mean plant, by default in the loop of the run.

    Raises
    ------
    RecordError
        If there is no such run.
    ConfigError
        If the loop acts on an output that the run does not have, or the excitation is not a torque.
    """

    def __init__(self, section: MeasuredSection, loop: LoopSection | None) -> None:
        self._section, self._run = section, RunRecord.open(section.run)
        self._recorded = recorded_configuration(self._run.summary)
        self._given = loop
        self._loop = loop or LoopSection.model_validate(self._recorded.get("loop", {}))

    def machine(self) -> Machine:
        """The Machine of the run's mean response."""
        if self._loop.excitation_at != "plant input":
            raise ConfigError(
                "value-invalid",
                f"loop.excitation_at = {self._loop.excitation_at!r}, where an excitation is not a torque",
                "design for 'plant input'",
                key="loop.excitation_at",
                value=self._loop.excitation_at,
            )
        section, rate_hz = self._section, self._run.lines.rate_hz
        motion = {name: getattr(section, key) for name, key in MOTION_KEYS.items() if getattr(section, key) is not None}
        return measured_machine(
            MeasuredResponse.of(mean_of(self._run)), self._loop.build(rate_hz), rate_hz,
            output=self._output(), radius_m=section.radius_m, noise=section.noise, motion=motion,
            stroke_s=section.stroke_s, notes=self._notes(), encoder_counts_per_turn=section.encoder_counts_per_turn,
        )  # fmt: skip

    def loop_tables(self) -> dict[str, Any]:
        """[loop] of the file or of the run."""
        if self._given is not None:
            return self._given.model_dump(exclude_unset=True, exclude_none=True)
        recorded = self._recorded.get("loop", {})
        return {name: value for name, value in recorded.items() if name != "controllers"}

    def signal_names(self) -> dict[str, str]:
        """[signals] of the run; a design always has an excitation."""
        return {"excitation": "w"} | dict(self._recorded.get("signals", {}))

    def tracking(self) -> dict[str, Any]:
        """The part of the run's [tracking] that its recordings need."""
        tracking = self._recorded.get("tracking", {})
        kept = {name: tracking[name] for name in _KEPT if tracking.get(name)}
        return kept if "input" in self.signal_names() else {"estimator": "indirect"} | kept

    def _output(self) -> Output:
        own = self._own_output()
        if own and self._section.output and self._section.output != own:
            raise ConfigError(
                "value-mismatch",
                f"measured.output = {self._section.output!r}, but the output of the run is a {own}",
                "leave it out",
                key="measured.output",
                value=self._section.output,
                kind=own,
            )
        acts_on: Output = "position" if self._loop.position_pd is not None else "velocity"
        output = self._section.output or own or acts_on
        if output != acts_on and self._loop.build(self._run.lines.rate_hz).feedback is not None:
            other = "loop.velocity" if acts_on == "position" else "loop.position_pd"
            raise ConfigError(
                "value-mismatch",
                f"the run's output is a {output}, but its loop as described acts on a {acts_on}",
                f"describe {other}, or track the {acts_on}",
                key=other,
                value=output,
            )
        return output

    def _own_output(self) -> Output | None:
        """The kind of the run's output; None where only the description of the experiment specifies it."""
        kind = self._run.kinds.output
        if kind == "velocity" or kind == "position":
            return kind
        if kind is not None and self._section.output is None:
            raise ConfigError(
                "kind-needed",
                f"a design needs a velocity or a position, but the kind of the run's output is {kind!r}",
                "set measured.output",
                key="measured.output",
                value=kind,
                allowed=["velocity", "position"],
            )
        return None

    def _notes(self) -> tuple[str, ...]:
        notes = [] if self._given is None else [_UNCHECKED]
        unit = self._run.found.get("unit", "")
        if unit and not _in_n_m_and_rad(unit):
            notes.append(f"the run's plant is in {unit}: N m and rad here stand for these units")
        if not unit and self._section.output is None:
            taken = {"velocity": "a velocity in rad/s", "position": "a position in rad"}[self._output()]
            notes.append(f"the run has no units: its output is assumed to be {taken}, its input N m")
        return tuple(notes)


def _in_n_m_and_rad(unit: str) -> bool:
    output, input = split_plant_unit(unit)
    return output in ("rad/s", "rad") and input == "N m"
