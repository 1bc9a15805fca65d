"""The configuration of a recording from the roles of its channels: lines, window and estimator are found."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import tomli_w

from livebode.configuration import Axis, check_fit
from livebode.core import Lines, LivebodeError
from livebode.dataclass import dataclass
from livebode.estimation import DETECTION_LINES_MIN, Settings
from livebode.excitation import recognise
from livebode.language import Message
from livebode.preparation.followers import make_settings
from livebode.preparation.nonperiodic import suits_lpm
from livebode.preparation.plan import beginning, roles_in_doubt
from livebode.preparation.trend import drifting_channels
from livebode.sources import Log

if TYPE_CHECKING:
    from livebode.preparation.proposal import Proposals

_NOT_REPEATING = ("signal.not-periodic", "signal.too-short")
_FITTED = ("velocity", "position")
_PERIODIC = ("joint", "direct")
_FITTED_LINES_MIN = 4
"""Complex values for the six free parameters of two masses with an unknown gain."""
_COLUMN = 28  # of the comments

Tables = dict[str, dict[str, Any]]


@dataclass(frozen=True)
class Settled:
    """A valid configuration; `comments` by section and key, `doubts` about the roles."""

    tables: Tables
    comments: Mapping[tuple[str, str], str]
    doubts: list[str]

    def text(self, recording: str) -> str:
        """The configuration as TOML, with its comments."""
        lines = [f"# Written by `livebode inspect` from {recording}."]
        for section, table in self.tables.items():
            lines += ["", f"[{section}]"]
            parts = {key: value for key, value in table.items() if isinstance(value, dict)}
            for key, value in table.items():
                if key in parts:
                    continue
                line = tomli_w.dumps({key: value}).strip()
                comment = self.comments.get((section, key), "")
                lines.append(f"{line:<{_COLUMN - 1}} # {comment}" if comment else line)
            for key, part in parts.items():
                lines += ["", tomli_w.dumps({section: {key: part}}).strip()]
        return "\n".join(lines) + "\n"


def suitable_estimator(log: Log, signals: Mapping[str, str]) -> tuple[str, str]:
    """The estimator for these roles, and why: by whether the excitation, or else the input, repeats."""
    reference = signals.get("excitation") or signals.get("input")
    if reference is None:
        return "joint", ""
    w = beginning(log, reference)
    try:
        recognise(w, log.rate_hz)
    except LivebodeError as error:
        if error.code in _NOT_REPEATING and suits_lpm(w, log.rate_hz):
            return "lpm", Message("{channel} does not repeat, as noise or a single chirp", channel=reference)
    if "excitation" not in signals:
        return "direct", Message("without the excitation: for an open loop")
    return "joint", Message("for a machine in a control loop, whose excitation repeats")


def suitable_model(proposals: Proposals, signals: Mapping[str, str], estimator: str) -> str:
    """The model to fit for these roles: "auto" for a velocity or a position with enough lines, else "none".

    None with a schedule: a baseline of fits needs more windows at each place than a few strokes have.
    """
    kinds = {channel.name: channel.kind for channel in proposals.channels}
    reference = signals.get("excitation") or signals.get("input")
    fitted = kinds.get(signals.get("output", "")) in _FITTED and estimator in _PERIODIC and "schedule" not in signals
    if reference is None or not fitted:
        return "none"
    try:
        found = recognise(beginning(proposals.log, reference), proposals.log.rate_hz)
    except LivebodeError:  # a run gives the reason
        return "none"
    return "auto" if len(found.lines) >= _FITTED_LINES_MIN else "none"


def tables_of(
    source: Mapping[str, Any], signals: Mapping[str, str], *, estimator: str, average: bool, model: str
) -> Tables:
    """The tables of a configuration from its answers, for `settled`.

    Parameters
    ----------
    source
        Keys of [source]; those that are None are left out.
    signals
        The channel of each role.
    estimator
        Key of [tracking].
    average
        Whether to average over all periods, which the estimators of what does not repeat do anyway.
    model
        Of [fit]; "none" fits none.
    """
    averages = average and estimator not in ("lpm", "welch")
    return {
        "source": {key: value for key, value in source.items() if value is not None},
        "signals": dict(signals),
        "tracking": {"estimator": estimator} | ({"average": True} if averages else {}),
    } | ({} if model == "none" else {"fit": {"model": model}})


def settled(log: Log, tables: Tables, reasons: Mapping[str, str]) -> Settled:
    """Check the tables with the recording, and add lines and window if the excitation repeats.

    Raises
    ------
    LivebodeError
        If the recording contradicts the roles, or they do not suffice.
    """
    axis = Axis.of(tables, "the answers")
    if axis.fit is not None:
        check_fit(axis.fit)
    settings = make_settings(axis, log)
    doubts = roles_in_doubt(axis, log, settings)
    comments = {("signals", role): reason for role, reason in reasons.items()}
    if not settings.periodic:
        return Settled(tables, comments, doubts)
    lines, periods = settings.lines, Message("one period")
    if "schedule" in tables["signals"] and len(lines.quiet) < DETECTION_LINES_MIN:
        lines = Lines(tuple(2 * k for k in lines.bins), lines.window * 2, log.rate_hz)
        periods = Message("two periods, so that bins without excitation show the noise in motion")
    found = {"frequencies": lines.text, "window": lines.window}
    count = Message("1 line") if len(lines) == 1 else Message("{n} lines", n=len(lines))
    low_hz, high_hz = lines.frequency_hz[0], lines.frequency_hz[-1]
    comments["lines", "frequencies"] = Message(
        "{count}, {low:.6g} … {high:.6g} Hz", count=count, low=low_hz, high=high_hz
    )
    comments["lines", "window"] = Message(
        "samples: {s:.6g} s, {periods}", s=lines.window / log.rate_hz, periods=periods
    )
    tables, about = _with_trend(log, tables, settings)
    comments |= about
    order = ("source", "signals", "lines")
    head = {name: tables[name] if name != "lines" else found for name in order}
    return Settled(head | {name: table for name, table in tables.items() if name not in order}, comments, doubts)


def _with_trend(log: Log, tables: Tables, settings: Settings) -> tuple[Tables, dict[tuple[str, str], str]]:
    """The tables with what is done to signals that drift, and its comment: a live source cannot look ahead."""
    drifting = drifting_channels(log, settings)
    if not drifting:
        return tables, {}
    names = [one.channel for one in drifting]
    key, value = ("trend", "subtract") if "log" in tables["source"] else ("differenced", names)
    comment = Message("{channels} drifts", channels=Message.conjunction(names))
    if len(names) > 1:
        comment = Message("{channels} drift", channels=Message.conjunction(names))
    return tables | {"tracking": tables["tracking"] | {key: value}}, {("tracking", key): comment}
