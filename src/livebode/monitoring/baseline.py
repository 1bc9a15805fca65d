"""Baseline: the healthy machine, as it was learned, and what a run must share with those that it was learned from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from livebode.core import BaselineError, Lines
from livebode.estimation import Settings
from livebode.monitoring.machine import Machine
from livebode.monitoring.rows import PLACES, places
from livebode.monitoring.table import Table

ROLES = ("output", "input", "excitation", "schedule")

_ON = {True: "on", False: "off"}


@dataclass(frozen=True, eq=False)
class Baseline:
    """What the healthy machine is like over a scheduling signal.

    Attributes
    ----------
    lines
        Of the runs that it was learned from.
    hop
        Theirs, in samples.
    signals
        Channel names of output, input, excitation and schedule, None where there is none.
    estimator, quantity
        As in `Settings`; what the tables speak of.
    tables
        Mean and covariance of lines, and of parameters where there were any.
    machine
        A model that moves; None where the runs held no motion along a schedule, or no two masses fit.
    corrected
        Whether its responses were freed from the axis's motion.
    runs
        Where it was learned from.
    remark
        Why there is no machine; empty where there is one.
    """

    lines: Lines
    hop: int
    signals: dict[str, str | None]
    estimator: str
    quantity: str
    tables: tuple[Table, ...]
    machine: Machine | None
    corrected: bool = False
    runs: tuple[str, ...] = ()
    remark: str = ""

    def check(self, settings: Settings, corrected: bool = False) -> None:
        """BaselineError where a run with these settings cannot be compared with it."""
        mine, lines = self.lines, settings.lines
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
        """Channels that its machine depends on beside torque, velocity and position."""
        return self.machine.covariates.names if self.machine is not None else ()

    def check_covariates(self, names: tuple[str, ...]) -> None:
        """BaselineError where a run names other covariates than these; naming none takes them from here."""
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
        """Where in the period the rows of its tables stood; of five or more it is good for any other."""
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
    def load(cls, path: Path) -> Baseline:
        """The baseline in a file; BaselineError where it cannot be read or is none."""
        from livebode.monitoring.baseline_file import load

        return load(path)

    def save(self, path: Path) -> None:
        """Write it to a file, whole or not at all; see docs/monitoring.md for what is in it."""
        from livebode.monitoring.baseline_file import save

        save(self, path)


def signals_of(settings: Settings) -> dict[str, str | None]:
    """Channel names by role."""
    return {role: getattr(settings, role) for role in ROLES}


def _named(lines: Lines) -> str:
    f = lines.frequency_hz
    few = ", ".join(f"{x:g}" for x in f) if len(f) <= 12 else f"{f[0]:g} … {f[-1]:g} ({len(f)})"
    return f"{few} Hz"
