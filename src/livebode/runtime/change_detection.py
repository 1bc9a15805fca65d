"""Detects changes of a run by comparison with a baseline, or reports that it cannot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import nan
from typing import TYPE_CHECKING

from livebode.configuration import Axis
from livebode.core import Block, Event, Parameters, Responses, Stage
from livebode.estimation import Settings
from livebode.language import Message
from livebode.runtime.baseline_comparison import BaselineComparison, no_effect

if TYPE_CHECKING:
    from livebode.monitoring import Monitor

_NOT_FITTED = Message("The baseline's fitted parameters are not judged: the run has no [fit].")
_NO_SAMPLES = Message("The baseline's model of the machine is not used: it needs samples at regular times.")


class ChangeDetection(BaselineComparison["Monitor"]):
    """Passes a run's samples and responses to a Monitor, if there is one, and lists its alarms for run.json."""

    _stage = Stage("change-detection", 1)
    _no_baseline = Message(
        "Without a baseline no change can be detected; `livebode learn` creates one from healthy runs."
    )

    def __init__(
        self,
        monitor: Monitor | None,
        baseline: str | None,
        remarks: Sequence[Message] = (),
        covariates: tuple[str, ...] = (),
        baseline_id: str | None = None,
    ) -> None:
        super().__init__(monitor, baseline, remarks, baseline_id)
        self.covariates = covariates
        """Channels that it needs in addition to those of the follower."""

    @property
    def watched(self) -> tuple[str, ...]:
        """Parameters that it compares, the first one first."""
        return () if self._monitor is None else self._monitor.parameters

    @property
    def active(self) -> bool:
        """Whether a change is active."""
        return self._monitor is not None and self._monitor.active

    @property
    def judges(self) -> bool:
        """Whether it has judged anything yet."""
        return self._monitor is not None and self._monitor.judged > 0

    def deviation(self, name: str) -> float:
        """Newest relative deviation of a parameter from the baseline; NaN where it is not known."""
        return nan if self._monitor is None else self._monitor.deviation(name)

    def take_samples(self, block: Block) -> list[Event]:
        """Monitor the next samples; without this call they are a gap for the Monitor."""
        return [] if self._monitor is None else self._listed(self._monitor.process_samples(block))

    def take_responses(self, responses: Responses, parameters: Parameters | None) -> list[Event]:
        """Monitor the results of the samples."""
        return [] if self._monitor is None else self._listed(self._monitor.process_responses(responses, parameters))

    def finish(self) -> list[Event]:
        """The last events, at the end of the run."""
        return [] if self._monitor is None else self._listed(self._monitor.finish())


def change_detection(axis: Axis, settings: Settings, *, samples: bool = True) -> ChangeDetection:
    """For these settings; BaselineError if the baseline cannot be read or does not fit.

    Without `samples` only its tables are used, because the model of the machine needs samples.
    """
    section = axis.monitoring
    covariates = tuple(section.covariates) if samples else ()
    if section.baseline is None:
        return ChangeDetection(None, None, no_effect(section), covariates)
    from livebode.monitoring import Baseline, Monitor  # with the simulation

    baseline = Baseline.load(section.baseline)
    learned = baseline.id
    baseline.check_covariates(covariates)
    left_out = not samples and baseline.machine is not None
    if not samples:
        baseline = replace(baseline, machine=None, torque=None)
    monitor = Monitor(baseline, settings, 86400 * section.false_alarm_interval_days, corrected=axis.motion is not None)
    blind = axis.fit is None and "parameters" in monitor.tables
    remarks = [_NOT_FITTED] * blind + [_NO_SAMPLES] * left_out
    return ChangeDetection(monitor, str(section.baseline), remarks, baseline.covariates, learned)
