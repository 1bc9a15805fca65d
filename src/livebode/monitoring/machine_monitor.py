"""Samples in, Events out: compares the machine with a learned Machine."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from livebode.core import Block, Event, Lines, Stage, StatefulBase
from livebode.language import Message
from livebode.monitoring.alarms import Alarm
from livebode.monitoring.evidence import Evidence
from livebode.monitoring.false_alarms import threshold
from livebode.monitoring.machine import LearnedMachine
from livebode.monitoring.machine_detector import CHARTS, MachineDetector
from livebode.monitoring.model_evidence import ModelEvidence
from livebode.monitoring.sentences import about, about_far, joint
from livebode.monitoring.stretches import Stretches, WindowStretch

Look = Callable[[Evidence], object]


class MachineMonitor(StatefulBase):
    """Judges every steady window of a recording by a learned Machine.

    Delay: an Event is given at the latest with the first sample of the twelfth window after the one that it refers to.
    The Events do not depend on how the samples are cut into Blocks.
    """

    _stage = Stage("machine-monitor", 1)
    _STATE = ("_stretches", "detector")

    def __init__(self, machine: LearnedMachine, lines: Lines, names: tuple[str, str, str], mean_s: float) -> None:
        self._stretches = Stretches((*names, *machine.covariates.names), lines.window, lines.rate_hz)
        self._evidence = ModelEvidence(machine, lines)
        charts = CHARTS + (2 if machine.between is not None else 0)
        self.detector = MachineDetector(machine, threshold(mean_s, lines.window / lines.rate_hz, charts))

    def process(self, block: Block, look: Look | None = None) -> list[Event]:
        """Events of the windows that this Block completes; LivebodeError where a channel is missing.

        `look` is called with the Evidence of every stretch, to show or record it.
        """
        return self._judged(self._stretches.process(block), look)

    def rest(self, look: Look | None = None) -> list[Event]:
        """Events of the remaining windows; the next Block starts again without history."""
        return self._judged(self._stretches.finish(), look)

    def finish(self, look: Look | None = None) -> list[Event]:
        """The same, and a change that was found but not yet separated from others."""
        return self.rest(look) + self.detector.finish()

    def standing(self) -> list[dict[str, Any]]:
        """Active changes as plain data."""
        alarms = self.detector.standing.alarms
        far = [about_far(alarms[-1])] if self.detector.standing.far else []
        return far + [about(alarm, within_run=self.detector.within_run(alarm)) for alarm in self._announced()]

    def together(self) -> list[Message]:
        """Their present amounts, estimated together; empty where none is known."""
        if self.detector.standing.far:
            return [Message("the machine is so far from the baseline that no amount can be given")]
        return joint(self._announced())

    def _announced(self) -> list[Alarm]:
        return [alarm for alarm in self.detector.standing.alarms if alarm.announced]

    def _judged(self, stretches: list[WindowStretch], look: Look | None) -> list[Event]:
        events: list[Event] = []
        for stretch in stretches:
            seen = self._evidence.process(stretch, self.detector.offset)
            if look is not None:
                look(seen)
            events += self.detector.process(seen)
        return events

    def _state(self) -> dict[str, Any]:
        return super()._state() | {"level": self._evidence.level}

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        self._evidence.level = float(state["level"])
