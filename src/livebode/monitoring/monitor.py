"""Monitor: compares a run with a Baseline, by its model of the machine or by its tables."""

from __future__ import annotations

from math import isfinite, nan
from typing import Any

import numpy as np

from livebode.core import Block, Event, Parameters, Responses, Stage, StatefulBase, UsageError
from livebode.estimation import Settings
from livebode.monitoring._result_sentence import result_sentence
from livebode.monitoring.baseline import Baseline
from livebode.monitoring.charts import DEFAULT_INTERVAL_S
from livebode.monitoring.machine_detector import MachineMonitor
from livebode.monitoring.table import NonOverlappingWindows, WindowRows, places
from livebode.monitoring.table_monitor import TableMonitor
from livebode.monitoring.torque_monitor import TorqueMonitor

_NAMED = "not_monitored", "detectable_percent"  # entries of the summary of a table, by component


class Monitor(StatefulBase):
    """Events of changes, from the samples of a run and the responses of its Tracker.

    If the Baseline has a model of the moving machine, that model is used; else its tables of lines and, where
    parameters are given, of parameters. Friction and orders are compared too, if it has them. The Events do not depend
    on how the samples are cut into Blocks.

    Parameters
    ----------
    baseline
        Learned from healthy runs.
    settings
        Those of the run.
    false_alarm_interval_s
        Mean time between false alarms in seconds of judged motion, at least; shared by all charts.
    corrected
        Whether the responses are freed from the axis's motion.

    Raises
    ------
    BaselineError
        If the baseline was learned with other lines or signals.
    UsageError
        If `false_alarm_interval_s` is not a positive finite number.

    Examples
    --------
    >>> import livebode, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     baseline = livebode.learn([livebode.example_run(f"{folder}/healthy", seconds=5)])
    >>> settings = Settings(lines=baseline.lines, excitation="w", input="u", output="velocity", hop=baseline.hop)
    >>> tracker, monitor = livebode.Tracker(settings), Monitor(baseline, settings)
    >>> for block in livebode.example_axis(seconds=2).blocks():
    ...     events = monitor.process(block, tracker.process(block))
    >>> monitor.summary()["message"]
    'No change against the baseline (1.8 s of the run judged).'
    """

    _stage = Stage("monitor", 1)

    def __init__(
        self,
        baseline: Baseline,
        settings: Settings,
        false_alarm_interval_s: float = DEFAULT_INTERVAL_S,
        *,
        corrected: bool = False,
    ) -> None:
        baseline.check(settings, corrected)
        if not (isfinite(false_alarm_interval_s) and false_alarm_interval_s > 0):
            raise UsageError(
                "out-of-range",
                f"{false_alarm_interval_s=} is not a positive finite number",
                "give the mean time between false alarms in seconds of judged motion",
                argument="false_alarm_interval_s",
                value=false_alarm_interval_s,
            )
        self.false_alarm_interval_s, self._baseline, self._settings = false_alarm_interval_s, baseline, settings
        mean_s, lines = false_alarm_interval_s, settings.lines
        apart = lines.window if baseline.machine is not None else baseline.apart
        self._step_s = apart / lines.rate_hz
        judges = 1 if baseline.machine is not None else len(baseline.tables)
        judges += len(baseline.torque.tables) if baseline.torque is not None else 0
        self._machine: MachineMonitor | None = None
        self._tables: dict[str, TableMonitor] = {}
        if baseline.machine is not None:
            assert settings.input is not None
            assert settings.schedule is not None
            names = settings.input, settings.output, settings.schedule
            self._machine = MachineMonitor(baseline.machine, lines, names, mean_s * judges)
        else:
            self._tables = {t.what: TableMonitor(t, mean_s * judges, self._step_s) for t in baseline.tables}
        self._torque: TorqueMonitor | None = None
        if baseline.torque is not None:
            assert settings.input is not None
            channels = settings.input, settings.output
            self._torque = TorqueMonitor(baseline.torque, channels, lines.rate_hz, mean_s * judges)
        self.parameters = next((t.names for t in baseline.tables if t.what == "parameters"), ())
        """Names of the parameters that it compares with a table."""
        self._apart = {
            name: NonOverlappingWindows(apart, places(lines.window, settings.step)[0]) for name in self._tables
        }
        self._counts = {"change": 0, "change-cleared": 0}

    @property
    def tables(self) -> list[str]:
        """Quantities of the tables in use; none where the model is used."""
        return list(self._tables)

    def process(self, block: Block, responses: Responses, parameters: Parameters | None = None) -> list[Event]:
        """Events of these samples and of their responses and parameters."""
        return self.process_samples(block) + self.process_responses(responses, parameters)

    def process_samples(self, block: Block) -> list[Event]:
        """Events of these samples alone: those of the model of the machine, and of friction and orders."""
        judges = (self._machine, self._torque)
        return self._counted([event for judge in judges if judge is not None for event in judge.process(block)])

    def process_responses(self, responses: Responses, parameters: Parameters | None = None) -> list[Event]:
        """Events of these responses and parameters: those of the tables, where there is no model."""
        events: list[Event] = []
        if "lines" in self._tables and self._apart["lines"].takes(responses.sample):
            rows = self._apart["lines"].of_responses(responses)
            events += self._tables["lines"].process(_of_ready(rows, responses))
        if parameters is None or "parameters" not in self._tables:
            return self._counted(events)
        if self._apart["parameters"].takes(parameters.sample):
            rows = self._apart["parameters"].of_parameters(parameters.only(self.parameters))
            events += self._tables["parameters"].process(_of_ready(rows, responses))
        return self._counted(events)

    def finish(self) -> list[Event]:
        """Remaining Events at the end of a run."""
        events = self._machine.finish() if self._machine is not None else []
        events += self._torque.finish() if self._torque is not None else []
        return self._counted(events + [e for table in self._tables.values() for e in table.finish()])

    def _counted(self, events: list[Event]) -> list[Event]:
        for event in events:
            if event.kind in self._counts and event.details["what"] != "machine":  # whose amounts are counted
                self._counts[event.kind] += 1
        return events

    @property
    def judged(self) -> int:
        """Windows judged so far."""
        return self._machine.detector.judged if self._machine else max(t.judged for t in self._tables.values())

    @property
    def active(self) -> bool:
        """Whether a change is active."""
        return bool(self._standing())

    def deviation(self, name: str) -> float:
        """Newest relative deviation of a parameter from its table; NaN where it is not known."""
        table = self._tables.get("parameters")
        return nan if table is None or name not in self.parameters else table.newest(self.parameters.index(name))

    def summary(self) -> dict[str, Any]:
        """Result of the run: judged time, numbers of raised and cleared alarms, and active changes."""
        standing = self._standing()
        summary: dict[str, Any] = {
            "false_alarm_interval_days": self.false_alarm_interval_s / 86400,
            "judged_by": "model" if self._machine else "tables",
            "covariates": list(self._baseline.covariates),
            **self._time(),
            "places_not_monitored_m": self._machine.detector.places.missing_m if self._machine else [],
            "changes": self._counts["change"] + any(isinstance(s, dict) and s["what"] == "machine" for s in standing),
            "cleared": self._counts["change-cleared"],
            "standing": standing,
        }
        summary |= {} if self._torque is None else {"torque": self._torque.summary()}
        together = self._machine.together() if self._machine else []
        return summary | {"message": result_sentence(summary, together)}

    def _standing(self) -> list[Any]:
        """Active changes: those of the model as plain data, of tables by their names."""
        tables = self._tables | ({} if self._torque is None else self._torque.tables)
        named = [name for name, table in tables.items() if table.standing]
        return [*(self._machine.standing() if self._machine else []), *named]

    def _time(self) -> dict[str, Any]:
        """What was monitored, and what not: the more of several tables."""
        if self._machine is not None:
            return self._machine.detector.time.summary(self._step_s)
        each = [table.time.summary(self._step_s) for table in self._tables.values()]
        best = max(each, key=lambda time: time["judged_s"])
        named = {name: {k: v for time in each for k, v in time[name].items()} for name in _NAMED}
        return best | named

    def _stages(self) -> dict[str, StatefulBase]:
        stages: dict[str, StatefulBase] = {} if self._machine is None else {"machine": self._machine}
        apart = {f"{name} apart": rows for name, rows in self._apart.items()}
        torque: dict[str, StatefulBase] = {} if self._torque is None else {"torque": self._torque}
        return stages | torque | self._tables | apart

    def _state(self) -> dict[str, Any]:
        return {"counts": self._counts} | self._stages()

    def _load(self, state: dict[str, Any]) -> None:
        for name, stage in self._stages().items():
            stage.restore(state[name])
        self._counts = {name: int(state["counts"][name]) for name in self._counts}

    @property
    def _identity(self) -> str:
        judges = "machine" if self._machine else ", ".join(self._tables)
        judges += ", torque" if self._torque is not None else ""
        return f"{self._settings.identity} {self.false_alarm_interval_s!r} {judges}"


def _of_ready(rows: WindowRows, responses: Responses) -> WindowRows:
    """Rows of a machine that was ready: other time is reported as suppressed."""
    return rows if responses.ready.all() else rows[~np.isin(rows.sample, responses.sample[~responses.ready])]
