"""Detects changes of a matrix run by comparison with a baseline, or reports that it cannot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from livebode.configuration import Axis
from livebode.core import ConfigError, Event, MatrixResponses, Stage
from livebode.language import Message
from livebode.runtime import BaselineComparison, no_effect
from livebode_matrix.settings import MatrixSettings

if TYPE_CHECKING:
    from livebode_matrix.monitor import MatrixMonitor

_NOT_JUDGED = Message("Nothing of the run could be judged: no matrix has valid columns and enough repetitions.")
_NOT_USED = Message("monitoring.gantry has no effect without one.")


class MatrixDetection(BaselineComparison["MatrixMonitor"]):
    """Passes a run's matrices to a MatrixMonitor, if there is one, and lists its alarms for run.json."""

    _stage = Stage("matrix-detection", 1)
    _no_baseline = Message(
        "Without a baseline no change can be detected; monitoring.baseline specifies a run of the healthy machine."
    )

    def process(self, responses: MatrixResponses) -> list[Event]:
        """Events of these matrices."""
        return [] if self._monitor is None else self._listed(self._monitor.process(responses))

    def take_over(self, before: MatrixDetection) -> None:
        """Continue with the alarms of the previous one, unless its baseline was replaced."""
        if self.compared_with == before.compared_with:
            self.restore(before.snapshot())

    def _result(self, monitor: MatrixMonitor) -> dict[str, Any]:
        from livebode.monitoring import result_sentence  # with the simulation

        result = monitor.summary()
        return result | {"message": result_sentence(result) if result["judged_s"] else _NOT_JUDGED}


def matrix_detection(axis: Axis, settings: MatrixSettings) -> MatrixDetection:
    """For these settings.

    Raises
    ------
    BaselineError
        If the baseline cannot be read or does not fit.
    ConfigError
        If the noise of a matrix is not known well enough to compare it.
    LivebodeError
        If the description of the gantry cannot be read or does not fit.
    """
    section = axis.monitoring
    if section.baseline is None:
        return MatrixDetection(None, None, no_effect(section) + [_NOT_USED] * (section.gantry is not None))
    from livebode_matrix.baseline import MatrixBaseline  # with the simulation
    from livebode_matrix.gantry_file import read_gantry
    from livebode_matrix.monitor import MatrixMonitor, matrix_digest

    _check_noise(settings)
    baseline = MatrixBaseline.load(section.baseline)
    baseline.check(settings)
    monitor = MatrixMonitor(
        baseline.matrices,
        false_alarm_interval_s=86400 * section.false_alarm_interval_days,
        description=None if section.gantry is None else read_gantry(section.gantry),
        noise_samples=settings.noise_samples,
    )
    return MatrixDetection(monitor, str(section.baseline), baseline_id=matrix_digest(baseline.mean))


def _check_noise(settings: MatrixSettings) -> None:
    outputs = len(settings.output)
    if settings.noise_dof > outputs:
        return
    needed = settings.memory + (outputs - settings.noise_dof) // settings.count + 1
    raise ConfigError(
        "value-mismatch",
        f"monitoring needs the noise of {outputs} outputs, but experiments.memory = {settings.memory} gives "
        f"{settings.noise_dof} degrees of freedom",
        f"set experiments.memory to {needed} or more",
        key="experiments.memory",
        value=settings.memory,
    )
