"""The loop of a run checked on its samples."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.configuration import Axis, LoopSection, recorded_configuration, recorded_loop
from livebode.core import Block, Channel, RecordError, SignalError, UsageError
from livebode.records import RunRecord, channels_of, write_loop_check
from livebode.sources import open_log
from livebode_control.clean_stretch import clean_stretch
from livebode_control.loop_check.loop_check import LoopCheck, check_loop
from livebode_control.loop_check.loop_equation import LoopSignals

_SAMPLES_MAX = 10_000_000  # of a long live run: its first ones
_VERDICTS = ("as described", "one change", "not explained")
_WORDS = {
    "excitation": "the excitation w (signals.excitation)",
    "input": "the plant input u (signals.input)",
    "output": "the output y (signals.output)",
}


def check_loop_of_run(
    directory: Path, section: LoopSection | None = None, channels: dict[str, str | None] | None = None
) -> tuple[LoopCheck, LoopSection]:
    """Check a run's loop, and the description that was checked: `section`, else that of the run.

    The samples are those that the run recorded, else those of its recordings; the longest stretch without a gap.

    Parameters
    ----------
    directory
        Of the run.
    section
        Another description of the loop.
    channels
        Channels by role (excitation, input, output) that replace those of the run.

    Raises
    ------
    RecordError
        If the run names no excitation or no input, or has no samples.
    RecordingError, SignalError
        If a recording or a channel is missing, or all stretches are too short.
    UsageError, ConfigError
        If the loop is not described, or its rates differ from that of the samples.
    """
    run = RunRecord.open(directory)
    if section is None:
        section = recorded_loop(run.summary)
    given = {role: name for role, name in (channels or {}).items() if name}
    signals = recorded_configuration(run.summary).get("signals", {})
    return _checked(run, section, {**signals, **given}), section


def check_controllers_of_run(
    directory: Path, section: LoopSection | None = None
) -> tuple[dict[str, LoopCheck], LoopSection]:
    """Check each controller of a matrix run against its own signals, by the name "output/input".

    The equation u = E·w − F·y of an input contains the other inputs only by the measured output, so one controller is
    checked as that of a single loop.

    Parameters
    ----------
    directory
        Of the run.
    section
        Another description of the loop.

    Raises
    ------
    UsageError
        If no controller is described, or two act on one input.
    LivebodeError
        As of `check_loop_of_run`.
    """
    run = RunRecord.open(directory, matrix=True)
    if section is None:
        section = recorded_loop(run.summary)
    signals = recorded_configuration(run.summary).get("signals", {})
    roles: dict[str, list[str]] = {
        role: [names] if isinstance(names, str) else names or []
        for role in ("input", "excitation")
        for names in [signals.get(role)]
    }
    if not roles["input"] or not roles["excitation"]:
        raise RecordError(
            "not-tracked",
            "the run does not name its plant inputs and its excitations, which a check of its controllers needs",
            "run again with signals.input and signals.excitation",
            path=str(directory),
        )
    _check_decentral(section, roles["input"])
    checks = {}
    for controller in section.controllers:
        index = roles["input"].index(controller.input)
        channels = {"output": controller.output, "input": controller.input, "excitation": roles["excitation"][index]}
        own = section.of_controller(controller.output, controller.input)
        checks[f"{controller.output}/{controller.input}"] = _checked(run, own, channels)
    return checks, section


def _check_decentral(section: LoopSection, inputs: list[str]) -> None:
    names = [controller.input for controller in section.controllers]
    if not names:
        raise UsageError(
            "missing",
            "no controller is described, so there is nothing to check",
            "describe each under [[loop.controllers]], in the configuration of the run or in another file",
            argument="feedback",
        )
    for name in names:
        if name not in inputs:
            raise UsageError(
                "unknown-name",
                f"a controller acts on {name!r}, which is not an input of the run",
                f"choose {', '.join(inputs)}",
                argument="input",
                value=name,
                allowed=inputs,
            )
        if names.count(name) > 1:
            raise UsageError(
                "conflict",
                f"{names.count(name)} controllers act on the input {name!r}, and a check compares one with its signals",
                "check a loop with one controller for each input",
                argument="loop.controllers",
                value=name,
            )


def _checked(run: RunRecord, section: LoopSection, channels: dict[str, Any]) -> LoopCheck:
    """The check of one controller against the channels of its roles."""
    words = recorded_configuration(run.summary)
    section.described(run.lines.rate_hz)
    roles = {role: channels.get(role) for role in _WORDS}
    for role, name in roles.items():
        if name is None:
            raise RecordError(
                "not-tracked",
                f"the run does not name {_WORDS[role]}, which a check of its loop needs",
                f"run again with signals.{role}, or name the channel here",
                path=str(run.path),
                role=role,
            )
    names = list(dict.fromkeys(str(name) for name in roles.values()))
    if len(names) < len(roles):
        raise SignalError(
            "role-shared",
            f"excitation, input and output of a loop are three channels, and these are {', '.join(names)}",
            "name three channels",
            channels=names,
        )
    block = _longest_stretch(run, words, names)
    if abs(block.rate_hz / run.lines.rate_hz - 1) > 1e-9:
        raise SignalError(
            "rate-differs",
            f"the samples have {block.rate_hz:g} Hz, and the lines of the run belong to {run.lines.rate_hz:g} Hz",
            "check the loop of a run that was tracked from samples at an even rate",
            rate_hz=block.rate_hz,
            expected_hz=run.lines.rate_hz,
        )
    named = {role: str(name) for role, name in roles.items()}
    of = run.found["experiments"] if run.is_matrix else None
    starts = of and settled_starts(block, run.lines.window, of["dwell_periods"], of["settle_periods"], of["start"])
    return check_loop(LoopSignals.of(block, run.lines, **named, starts=starts), section)


def settled_starts(block: Block, period: int, dwell: int, settle: int, start: int = 0) -> NDArray[np.intp]:
    """Begins of the windows of two periods in the settled part of each experiment of a matrix run.

    Where that part is one period, its window also contains the period before it. `dwell` and `settle` are in periods,
    `start` is the sample of the first experiment; SignalError if an experiment has one period.
    """
    if dwell < 2:
        raise SignalError(
            "too-short",
            "an experiment of one period is too short for a check of the controllers, which needs two",
            "record with a longer dwell",
            samples=period,
            limit=2 * period,
        )
    places = np.arange(min(settle, dwell - 2), dwell - 1) * period
    first = -((block.start - start) // -(dwell * period)) - 1  # the experiment in which the block begins
    begins = start - block.start + dwell * period * np.arange(first, first + len(block) // (dwell * period) + 2)
    starts = (begins[:, np.newaxis] + places).ravel()
    return np.asarray(starts[(starts >= 0) & (starts + 2 * period <= len(block))], dtype=np.intp)


def store_loop_check(directory: Path, check: LoopCheck, section: LoopSection) -> Path:
    """Write the result and the description that it belongs to into a directory."""
    return write_loop_check(directory, {**check.plain(), "loop": section.model_dump(mode="json")})


def store_controller_checks(directory: Path, checks: dict[str, LoopCheck], section: LoopSection) -> Path:
    """Write the results for the controllers of a matrix, and the description that they belong to."""
    worst = max(checks.values(), key=lambda check: _VERDICTS.index(check.verdict))
    whole = {"verdict": worst.verdict, "sentence": worst.sentence}
    each = {name: check.plain() for name, check in checks.items()}
    return write_loop_check(directory, {**whole, "controllers": each, "loop": section.model_dump(mode="json")})


def _longest_stretch(run: RunRecord, words: dict[str, Any], names: list[str]) -> Block:
    recorded = _recorded(run, names)
    if recorded is not None:
        return recorded
    if words.get("source", {}).get("log"):
        return _of_logs(words, names, str(run.path))
    raise RecordError(
        "no-samples",
        f"the run in {str(run.path)!r} has no recorded samples of {', '.join(names)}",
        "record them with samples = true in [record]",
        path=str(run.path),
    )


def _of_logs(words: dict[str, Any], names: list[str], where: str) -> Block:
    used: dict[str, Any] = {key: words[key] for key in ("source", "signals", "monitoring") if key in words}
    if any(isinstance(channels, list) for channels in used.get("signals", {}).values()):
        used |= _without_matrix(used)
    axis = Axis.of(used, where)
    given, ready = axis.source, axis.ready
    stretches = []
    for log in given.logs:
        opened = open_log(log, rate_hz=given.rate_hz, time=given.time, dbc=given.dbc, channels=names, units=given.units)
        stretches.append(clean_stretch(opened, names, ready if ready and opened.has(ready.channel) else None)[0])
    return max(stretches, key=len)


def _without_matrix(words: dict[str, Any]) -> dict[str, Any]:
    """What says when the machine is ready: lists would need the lines and experiments of the matrix."""
    signals, monitoring = words["signals"], words.get("monitoring", {})
    output = signals["output"]
    ready = {"ready": signals["ready"]} if "ready" in signals else {}
    bits = {name: monitoring[name] for name in ("ready_mask", "ready_value") if name in monitoring}
    return {"signals": {"output": output[0] if isinstance(output, list) else output} | ready, "monitoring": bits}


def _recorded(run: RunRecord, names: list[str]) -> Block | None:
    """The longest stretch of the samples that a run recorded, if it recorded these channels."""
    parts = list(_tables(run, names))
    if not parts:
        return None
    number, data = (np.concatenate(part, axis=-1) for part in zip(*parts))
    clean = np.isfinite(data).all(axis=0)
    follows = np.concatenate([[False], np.diff(number) == 1]) & clean
    starts = np.flatnonzero(~follows)
    lengths = np.diff(np.append(starts, number.size))
    longest = int(np.argmax(lengths))
    first = int(starts[longest]) + (0 if clean[starts[longest]] else 1)
    stretch = data[:, first : int(starts[longest] + lengths[longest])]
    begin = int(number[first])
    return Block(stretch, tuple(Channel(name) for name in names), float(run.found["rate_hz"]), start=begin)


def _tables(run: RunRecord, names: list[str]) -> Iterator[tuple[Any, Any]]:
    count = 0
    for table in run.tables("samples"):
        columns = dict(zip([channel.name for channel in channels_of(table.schema)], table.column_names[2:]))
        if not set(names) <= set(columns) or count > _SAMPLES_MAX:
            return
        count += table.num_rows
        yield table["sample"], np.stack([table[columns[name]] for name in names])
