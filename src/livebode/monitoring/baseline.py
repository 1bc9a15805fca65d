"""Baseline: the learned healthy machine, and the settings that a run must share with the learned runs."""

from __future__ import annotations

from dataclasses import replace
from os import PathLike
from pathlib import Path

from livebode.core import BaselineError, Lines, counted
from livebode.dataclass import dataclass
from livebode.estimation import Settings
from livebode.monitoring import baseline_file
from livebode.monitoring.baseline_file import ROLES
from livebode.monitoring.baseline_part import BaselineVersion, retained_file
from livebode.monitoring.learned_torque import LearnedTorque
from livebode.monitoring.machine import LearnedMachine
from livebode.monitoring.table import PLACES, ScheduleTable, places

_ON = {True: "on", False: "off"}


@dataclass(frozen=True, eq=False)
class Baseline:
    """Description of the healthy machine over a scheduling signal.

    Attributes
    ----------
    lines
        Lines of the learned runs.
    hop
        Hop of the learned runs, samples.
    signals
        Channel names of output, input, excitation and schedule, None where there is none.
    estimator, quantity
        As in `Settings`, for the tables.
    tables
        Mean and covariance of lines, and of parameters where there were any.
    machine
        Model of the moving machine; None where the runs have no motion along a schedule, or no two-mass model fits.
    torque
        Friction and orders of the axis; None where the runs have no input or too few strokes.
    corrected
        Whether its responses were corrected for the axis's motion.
    runs
        The runs that it was learned from.
    remark, torque_remark
        Reason for the missing machine, and for the missing friction and orders; empty where there is one.
    learned
        When it was learned, ISO 8601 in UTC.
    reason
        Why it was learned; empty where nobody stated it.
    history
        The versions that it replaced, the newest first.

    Examples
    --------
    >>> import livebode, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     baseline = livebode.learn([livebode.example_run(f"{folder}/healthy", seconds=5)])
    ...     baseline.save(f"{folder}/healthy.json")
    ...     Baseline.load(f"{folder}/healthy.json")
    <Baseline: lines and parameters, 13 lines, 20 … 140 Hz; learned from 1 run>
    """

    lines: Lines
    hop: int
    signals: dict[str, str | None]
    estimator: str
    quantity: str
    tables: tuple[ScheduleTable, ...]
    machine: LearnedMachine | None
    torque: LearnedTorque | None = None
    corrected: bool = False
    runs: tuple[str, ...] = ()
    remark: str = ""
    torque_remark: str = ""
    learned: str = ""
    reason: str = ""
    history: tuple[BaselineVersion, ...] = ()

    @property
    def id(self) -> str:
        """The first 16 hexadecimal digits of the SHA-256 of what was learned: two files with one id judge alike."""
        return baseline_file.id_of(vars(self))

    @property
    def version(self) -> BaselineVersion:
        """This version, as the next one lists it in its history."""
        return BaselineVersion(self.id, self.learned, self.runs, self.reason)

    def __repr__(self) -> str:
        f, tables = self.lines.frequency_hz, [*self.tables, *(self.torque.tables if self.torque is not None else ())]
        quantities = [table.what for table in tables]
        learned = " and ".join([*quantities, "a model of the machine"] if self.machine is not None else quantities)
        span = f"{counted(len(f), 'line')}, {f[0]:g} … {f[-1]:g} Hz"
        return f"<Baseline: {learned}, {span}; learned from {counted(len(self.runs), 'run')}>"

    def check(self, settings: Settings, corrected: bool = False) -> None:
        """BaselineError where a run with these settings cannot be compared with it."""
        mine = self.lines
        lines = mine if mine.alike(settings.lines) else settings.lines
        signals = signals_of(settings)
        for name, learned, here in (
            ("rate", f"{mine.rate_hz:g} Hz", f"{lines.rate_hz:g} Hz"),
            ("window", f"{mine.window} samples", f"{lines.window} samples"),
            ("lines", _named(mine), _named(lines)),
            ("estimator", self.estimator, settings.estimator),
            ("quantity", self.quantity, settings.quantity),
            ("motion correction", _ON[self.corrected], _ON[corrected]),
            *((role, str(self.signals[role]), str(signals[role])) for role in signals),
        ):
            if learned != here:
                raise BaselineError(
                    "settings-differ",
                    f"the baseline was learned with {name} {learned}, and this run has {here}",
                    f"take the same {name}, or learn a baseline from such runs",
                    setting=name,
                    learned=learned,
                    value=here,
                )
        if self.machine is None:
            self._check_hop(settings.step)

    @property
    def covariates(self) -> tuple[str, ...]:
        """Channels that its machine depends on in addition to torque, velocity and position."""
        return self.machine.covariates.names if self.machine is not None else ()

    def check_covariates(self, names: tuple[str, ...]) -> None:
        """Raise BaselineError for other covariates than these; a run without covariates uses those of the baseline."""
        if names and set(names) != set(self.covariates):
            learned, here = (", ".join(some) or "no covariates" for some in (self.covariates, names))
            raise BaselineError(
                "settings-differ",
                f"the baseline was learned with {learned}, and the covariates of this run are {here}",
                "take the same in [monitoring] covariates, or learn a baseline from such runs",
                setting="covariates",
                learned=list(self.covariates),
                value=list(names),
            )

    @property
    def apart(self) -> int:
        """Samples from one row of its tables to the next."""
        return max(self.lines.window, self.hop)

    @property
    def places(self) -> tuple[int, ...]:
        """Places in the period of its tables' rows; with five or more places it is valid for any other."""
        return places(self.lines.window, self.hop)

    def _check_hop(self, hop: int) -> None:
        window = self.lines.window
        known = len(self.places) >= PLACES or places(window, hop)[0] in self.places
        if not known or self.apart % max(window, hop):
            raise BaselineError(
                "settings-differ",
                f"the baseline was learned with hop {self.hop}, and this run has {hop}, whose windows are at places of "
                "the period that were not learned",
                f"take hop {self.hop}, or learn a baseline from such runs",
                setting="hop",
                learned=self.hop,
                value=hop,
            )

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Baseline:
        """The baseline in a file; BaselineError where it cannot be read or is not a baseline."""
        return cls(**baseline_file.load(Path(path)))

    def save(self, path: str | PathLike[str]) -> None:
        """Write it to a file, completely or not at all; docs/how-to/monitoring.md describes the content.

        An existing file is replaced; `save_version` retains it.
        """
        baseline_file.save(vars(self), Path(path))

    def save_version(self, path: str | PathLike[str], reason: str = "") -> Baseline:
        """Replace the baseline in a file as its next version, and return that.

        The previous file is retained as NAME.history/ID.json beside it, and the new one lists all earlier versions.
        Where both judge alike (same id), the file remains as it is.

        Parameters
        ----------
        path
            The file to replace.
        reason
            Why it is replaced.

        Raises
        ------
        BaselineError
            If there is no baseline in the file.
        OutputError
            If it cannot be written; the file is unchanged.
        """
        path = Path(path)
        previous = self.load(path)
        if previous.id == self.id:
            return previous
        following = replace(self, reason=reason, history=(previous.version, *previous.history))
        baseline_file.retain(path, retained_file(path, previous.id))
        following.save(path)
        return following


def signals_of(settings: Settings) -> dict[str, str | None]:
    """Channel names by role."""
    return {role: getattr(settings, role) for role in ROLES}


def _named(lines: Lines) -> str:
    f = lines.frequency_hz
    few = ", ".join(f"{x:g}" for x in f) if len(f) <= 12 else f"{f[0]:g} … {f[-1]:g} ({len(f)})"
    return f"{few} Hz"
