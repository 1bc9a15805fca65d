"""Ask for what the configuration of a recording needs, and write it: `livebode inspect --out`."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from livebode.cli import terminal
from livebode.cli.live_survey import heard, is_live
from livebode.cli.next_step import NextCommand
from livebode.cli.shell import command_line
from livebode.core import (
    LivebodeError,
    OutputError,
    RecordingError,
    SourceError,
    UsageError,
    read_quantity,
    read_unit,
    write_whole,
    writing,
)
from livebode.locations import Location, Url, local_copy, location

if TYPE_CHECKING:
    from rich.console import Console

    from livebode.preparation import ChannelSummary, Guess, Proposals, Settled
    from livebode.sources import Log

_NONE = "-"
_QUESTIONS = {
    "excitation": "Excitation, the signal that was added",
    "input": "Input of the plant, such as the torque",
    "output": "Output of the plant, such as the velocity",
    "schedule": "Schedule, what the response depends on, such as the position",
}
_EXAMPLES = {
    "torque": "0.024 N m", "current": "0.35 N m", "force": "12 N", "position": "1/131072 rev", "velocity": "1 rpm",
    "acceleration": "9.81 m/s²",
}  # fmt: skip
"""What one unit of a channel may be, by its kind: 1 % of a rated torque, 1 A by the torque constant, 1 count."""
_ESTIMATORS = ("joint", "direct", "lpm", "welch")
_CONCERNS = {"tracking.estimator": "estimator", "fit.model": "fit", "model": "fit"}
_WITHOUT_RATE = "recording.rate-missing"


def write_configuration(
    log: str,
    out: Path,
    given: dict[str, str | None],
    *,
    estimator: str | None,
    average: bool | None,
    fit: str | None,
    rate: float | None,
    time: str | None,
    dbc: Path | None,
    yes: bool,
    force: bool,
    as_json: bool,
) -> NextCommand:
    """Write the configuration of a recording: list its channels, propose their roles, ask, and find lines and window.

    What is given is not asked for; "-" is no channel. An answer that the recording contradicts is asked for again.
    """
    from livebode.preparation import Proposals
    from livebode.records import to_json

    source: Mapping[str, Any]

    asks = not (yes or as_json)
    _check_replaceable(out, force)
    console = terminal.console(markup=False) if asks else None
    if is_live(log):
        if asks:
            _check_terminal()
        recording, source = _heard(log, rate)
        title = log
    else:
        place = location(log)
        if asks:
            _check_recording(place)
            _check_terminal()
        recording, rate = _opened(place, rate, time, dbc, console)
        title = place.name
        source = {"log": _relative(place, out), "rate_hz": rate, "time": time, "dbc": dbc and _relative(dbc, out)}
    recording.naming([name for name in given.values() if name and name != _NONE])
    proposals = Proposals(recording)
    if console is not None:
        _list(proposals, console)
    known = given | {"estimator": estimator, "average": average, "fit": fit}
    dialog = Dialog(proposals, {key: value for key, value in known.items() if value is not None}, console)
    result = dialog.settled(source)
    for doubt in result.doubts:
        print(f"livebode: {doubt}", file=sys.stderr)
    with writing(out):
        out.parent.mkdir(parents=True, exist_ok=True)
        write_whole(out, result.text(title).encode())
    if as_json:
        print(to_json({"file": str(out), "configuration": result.tables}))
        return NextCommand("run", out)
    if console is None:
        reasons = ((role, name, result.comments["signals", role]) for role, name in result.tables["signals"].items())
        print("".join(f"{role}: {name} ({reason})\n" for role, name, reason in reasons), end="")
    print(out)
    return NextCommand("run", out)


def _heard(url: str, rate: float | None) -> tuple[Log, Mapping[str, Any]]:
    """What came from a live source, and its section [source]."""
    found = heard(url)
    if found.block is None:
        raise SourceError(
            "no-samples",
            found.trouble or "the channels have no samples in common",
            "docs/how-to/live.md describes what is read; correct the address or the sender",
            address=url,
        ).at(url)
    return found.log(rate)


def _check_recording(place: Location) -> None:
    """The error of a file that is missing or no recording, which nobody can answer."""
    from livebode.sources import read_head

    with local_copy(place) as path:
        read_head(path)


def _opened(
    place: Location, rate: float | None, time: str | None, dbc: Path | None, console: Console | None
) -> tuple[Log, float | None]:
    """The recording and the rate that its configuration needs, which is asked for where the recording has none."""
    from livebode.sources import open_log

    try:
        return open_log(place, rate_hz=rate, time=time, dbc=dbc), rate
    except RecordingError as error:
        if console is None or rate is not None or error.code != _WITHOUT_RATE:
            raise
        console.print(str(error.message), soft_wrap=True)
    from rich.prompt import FloatPrompt

    with _ended_input():
        while (rate := FloatPrompt.ask("Rate, samples per second", console=console)) <= 0:
            console.print(f"{rate:g} is not a positive number")
    return open_log(place, rate_hz=rate, time=time, dbc=dbc), rate


class Dialog:
    """Questions for what a configuration needs; an answer that is wrong is asked for again, the others are retained.

    Parameters
    ----------
    proposals
        Proposals of the recording.
    given
        Answers that are known: channels of roles ("-" for none), "estimator", "average" and "fit".
    console
        Where to ask; None takes every proposal.
    """

    def __init__(self, proposals: Proposals, given: Mapping[str, Any], console: Console | None) -> None:
        self._proposals, self._console = proposals, console
        self._given, self._answers = given, dict(given)
        self._reasons = dict.fromkeys(_QUESTIONS, "as specified")
        self._units: dict[str, str] = {}  # of each channel that was asked for; empty: not known

    def settled(self, source: Mapping[str, Any]) -> Settled:
        """The checked configuration of all answers with this section [source].

        Raises
        ------
        LivebodeError
            If the recording contradicts what was given, or without a console a proposal.
        """
        from livebode.preparation import settled

        while True:
            try:
                signals, reasons = self._signals()
                units = self._source_units(signals)
                given = {**source, "units": units} if units else source
                return settled(self._proposals.log, self._tables(given, signals), reasons)
            except LivebodeError as error:
                wrong = [key for key in _concerned(error, self._answers) if key not in self._given]
                if self._console is None or not wrong:
                    raise
                self._console.print(f"{error}", style="yellow", soft_wrap=True)
                for key in wrong:
                    self._answers.pop(key, None)

    def _signals(self) -> tuple[dict[str, str], dict[str, str]]:
        """The channel of each role, and the reason."""
        names = [channel.name for channel in self._proposals.channels]
        numbers = {str(number): name for number, name in enumerate(names, 1)}
        for role, question in _QUESTIONS.items():
            if role in self._answers:
                continue
            known = {key: _channel(name) for key, name in self._answers.items() if key in _QUESTIONS}
            guess = self._proposals.roles(known)[role]
            answer = _ask(
                self._console, question + _hint(guess), guess.channel or _NONE, (*names, *numbers, _NONE), shown=False
            )
            self._answers[role] = name = answer if answer in names else numbers.get(answer, answer)
            self._reasons[role] = guess.reason if name == guess.channel else "as specified"
        signals = {role: channel for role in _QUESTIONS if (channel := _channel(self._answers[role]))}
        _check_signals(signals, names, str(self._proposals.log.path))
        return signals, {role: self._reasons[role] for role in signals}

    def _source_units(self, signals: Mapping[str, str]) -> dict[str, str]:
        """What one unit of the input and of the output is, where the recording does not say it in SI units."""
        used = {signals[role]: role for role in ("input", "output")}
        for channel in self._proposals.channels if self._console is not None else ():
            if channel.name in used and channel.name not in self._units:
                asked = not read_unit(channel.unit).si or channel.kind == "current"
                self._units[channel.name] = self._unit_of(channel, used[channel.name]) if asked else ""
        return {name: unit for name in used if (unit := self._units.get(name, ""))}

    def _unit_of(self, channel: ChannelSummary, role: str) -> str:
        assert self._console is not None
        kind = channel.kind if channel.kind in _EXAMPLES else {"input": "torque", "output": "velocity"}[role]
        example = _EXAMPLES[kind]
        one = f"1 {channel.unit}" if channel.unit else "the value 1"
        question = f"What is {one} of {channel.name}, such as {example}"
        while answer := _line(self._console, f"{question} (Enter: not known)"):
            if read_quantity(answer).si:
                return answer
            self._console.print(f"{answer!r} is not a number of a unit that is recognised; write it as {example}")
        return ""

    def _tables(self, source: Mapping[str, Any], signals: dict[str, str]) -> dict[str, dict[str, Any]]:
        from livebode.plugins import named
        from livebode.preparation import suitable_estimator, suitable_model, tables_of

        answers, console = self._answers, self._console
        if "estimator" not in answers:
            suits, why = suitable_estimator(self._proposals.log, signals)
            answers["estimator"] = _ask(console, f"Estimator ({why})", suits, _ESTIMATORS)
        if "average" not in answers:
            still = "schedule" not in signals
            answers["average"] = _agrees(console, "Average over all periods, for a standstill", still)
        if "fit" not in answers:
            suits = suitable_model(self._proposals, signals, answers["estimator"])
            answers["fit"] = _ask(console, "Model to fit to the responses", suits, ("none", "auto", *named("models")))
        estimator, average, model = (answers[key] for key in ("estimator", "average", "fit"))
        return tables_of(source, signals, estimator=estimator, average=average, model=model)


def _channel(name: str | None) -> str | None:
    return None if name == _NONE else name


def _hint(guess: Guess) -> str:
    others = f"; {', '.join(guess.others)} also possible" if guess.others else ""
    return f" ({guess.channel}: {guess.reason}{others})" if guess.channel else ""


def _concerned(error: LivebodeError, answers: Mapping[str, Any]) -> list[str]:
    """The answers that an error is about, by its facts."""
    facts = error.facts
    channels = {facts.get("channel"), *facts.get("channels", ())}
    keys = {facts.get("argument"), facts.get("key"), *facts.get("roles", ())}
    keys |= {str(option).removeprefix("--") for option in facts.get("options", ())}
    keys |= {_CONCERNS.get(str(key)) for key in keys}
    return [key for key, value in answers.items() if key in keys or (key in _QUESTIONS and value in channels)]


def _check_replaceable(out: Path, force: bool) -> None:
    if out.is_dir() or (out.exists() and not force):
        raise OutputError(
            "exists",
            f"{str(out)!r} exists already",
            "choose another --out, or replace it with --force",
            path=str(out),
        )


def _check_terminal() -> None:
    if not sys.stdin.isatty():
        raise UsageError(
            "missing",
            "there is no terminal to ask on",
            "take the proposals with --yes, and name the channels that you know by --excitation, --input and --output",
            options=["--yes"],
        )


def _list(proposals: Proposals, console: Console) -> None:
    from rich.table import Table

    log = proposals.log
    console.print(f"{log.path}: {log.format}, {log.samples} samples at {log.rate_hz:.9g} Hz", soft_wrap=True)
    table = Table(box=None, header_style="bold")
    for heading in ("", "channel", "unit", "kind", "from", "to"):
        table.add_column(heading, justify="right" if heading in ("", "from", "to") else "left", overflow="fold")
    for number, channel in enumerate(proposals.channels, 1):
        ends = (f"{channel.minimum:.4g}", f"{channel.maximum:.4g}")
        table.add_row(str(number), channel.name, channel.unit, channel.kind, *ends)
    console.print(table)
    console.print(f"Answer with a number, a name, or {_NONE} for none; Enter takes the proposal in brackets.")


def _check_signals(signals: Mapping[str, str], names: Sequence[str], path: str) -> None:
    """UsageError if the roles do not suffice."""
    if "output" not in signals:
        raise UsageError(
            "missing",
            f"the output channel is not recognised among {', '.join(names)}",
            "give --output CHANNEL",
            argument="output",
        )
    alone = command_line("livebode", "run", path, "--output-only", "--output", signals["output"])
    modes = f"the modes are found by {alone}"
    if not {"excitation", "input"} & set(signals):
        raise UsageError(
            "missing",
            f"neither an excitation nor an input is recognised among {', '.join(names)}",
            "give --excitation and --input" + ("" if is_live(path) else f"; of an output alone {modes}"),
            options=["--excitation", "--input"],
        )
    if "input" not in signals:
        raise UsageError(
            "missing",
            f"the input channel is not recognised among {', '.join(names)}",
            "give --input CHANNEL",
            argument="input",
        )


def _ask(console: Console | None, question: str, default: str, choices: tuple[str, ...], *, shown: bool = True) -> str:
    """The answer; without a console the default."""
    if console is None:
        return default
    from rich.prompt import Prompt
    from rich.text import Text

    with _ended_input():
        return Prompt.ask(Text(question), console=console, choices=list(choices), show_choices=shown, default=default)


def _line(console: Console, question: str) -> str:
    """A line of text, which may be empty."""
    from rich.prompt import Prompt
    from rich.text import Text

    with _ended_input():
        return Prompt.ask(Text(question), console=console, default="", show_default=False).strip()


def _agrees(console: Console | None, question: str, default: bool) -> bool:
    if console is None:
        return default
    from rich.prompt import Confirm

    with _ended_input():
        return Confirm.ask(question, console=console, default=default)


@contextmanager
def _ended_input() -> Iterator[None]:
    """The end of the input stops the command like Ctrl-C."""
    try:
        yield
    except EOFError:
        raise KeyboardInterrupt from None


def _relative(path: Location, out: Path) -> str:
    """A path as the configuration names it, relative to itself; a URL without a secret."""
    if isinstance(path, Url):
        return str(path)
    if path.is_absolute():
        return path.as_posix()
    return Path(os.path.relpath(path, out.parent)).as_posix()
