"""Ask for what the configuration of a recording needs, and write it: `livebode inspect --out`."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from livebode.cli import terminal
from livebode.cli.shell import command_line
from livebode.core import OutputError, UsageError, write_whole, writing
from livebode.locations import Location, Url, location

if TYPE_CHECKING:
    from rich.console import Console

    from livebode.preparation import Proposals

_NONE = "-"
_QUESTIONS = {
    "excitation": "Excitation, the signal that was added",
    "input": "Input of the plant, such as the torque",
    "output": "Output of the plant, such as the velocity",
    "schedule": "Schedule, what the response depends on, such as the position",
}
_ESTIMATORS = ("joint", "direct", "lpm", "welch")
_MODELS = ("none", "auto", "rigid", "two-mass", "three-mass")


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
) -> None:
    """Write the configuration of a recording: list its channels, propose their roles, ask, and find lines and window.

    What is given is not asked for; "-" is no channel.
    """
    from livebode.preparation import Proposals, settled, suitable_estimator
    from livebode.records import to_json
    from livebode.sources import open_log

    asks = not (yes or as_json)
    _check_replaceable(out, force)
    place = location(log)
    recording = open_log(place, rate_hz=rate, time=time, dbc=dbc)
    if asks:
        _check_terminal()
    recording.naming([name for name in given.values() if name and name != _NONE])
    console = terminal.console(markup=False) if asks else None
    proposals = Proposals(recording)
    if console is not None:
        _list(proposals, console)
    signals, reasons = _roles(proposals, given, console)
    suits, why = suitable_estimator(recording, signals)
    chosen = estimator or _ask(console, f"Estimator ({why})", suits, _ESTIMATORS)
    still = "schedule" not in signals
    averages = average if average is not None else _agrees(console, "Average over all periods, for a standstill", still)
    model = fit or _ask(console, "Model to fit to the responses", "none", _MODELS)
    source = {"log": _relative(place, out), "rate_hz": rate, "time": time, "dbc": dbc and _relative(dbc, out)}
    tables: dict[str, dict[str, Any]] = {
        "source": {key: value for key, value in source.items() if value is not None},
        "signals": signals,
        "tracking": {"estimator": chosen} | ({"average": True} if averages and chosen not in ("lpm", "welch") else {}),
    }
    result = settled(recording, tables | ({} if model == "none" else {"fit": {"model": model}}), reasons)
    for doubt in result.doubts:
        print(f"livebode: {doubt}", file=sys.stderr)
    with writing(out):
        out.parent.mkdir(parents=True, exist_ok=True)
        write_whole(out, result.text(place.name).encode())
    if as_json:
        print(to_json({"file": str(out), "configuration": result.tables}))
        return
    if console is None:
        print("".join(f"{role}: {name} ({reasons[role]})\n" for role, name in signals.items()), end="")
    print(f"{out}\nTrack it: {command_line('livebode', 'run', str(out))}")


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


def _roles(
    proposals: Proposals, given: dict[str, str | None], console: Console | None
) -> tuple[dict[str, str], dict[str, str]]:
    """The channel of each role, and the reason."""
    signals: dict[str, str] = {}
    reasons: dict[str, str] = {}
    names = [channel.name for channel in proposals.channels]
    numbers = {str(number): name for number, name in enumerate(names, 1)}
    for role, question in _QUESTIONS.items():
        name, reason = given[role], "as specified"
        if name is None:
            guess = proposals.of(role, list(signals.values()))
            hint = f" ({guess.channel}: {guess.reason})" if guess.channel else ""
            answer = _ask(console, question + hint, guess.channel or _NONE, (*names, *numbers, _NONE))
            name = numbers.get(answer, answer) if answer not in names else answer
            reason = guess.reason if name == guess.channel else reason
        if name != _NONE:
            signals[role], reasons[role] = name, reason
    if "output" not in signals:
        raise UsageError(
            "missing",
            f"the output channel is not recognised among {', '.join(names)}",
            "give --output CHANNEL",
            argument="output",
        )
    alone = command_line("livebode", "run", str(proposals.log.path), "--output-only", "--output", signals["output"])
    if not {"excitation", "input"} & set(signals):
        raise UsageError(
            "missing",
            f"neither an excitation nor an input is recognised among {', '.join(names)}",
            f"give --excitation and --input; of an output alone the modes are found by {alone}",
            options=["--excitation", "--input"],
        )
    if "input" not in signals:
        raise UsageError(
            "missing",
            f"the input channel is not recognised among {', '.join(names)}",
            "give --input CHANNEL",
            argument="input",
        )
    return signals, reasons


def _ask(console: Console | None, question: str, default: str, choices: tuple[str, ...]) -> str:
    """The answer; without a console the default."""
    if console is None:
        return default
    from rich.prompt import Prompt
    from rich.text import Text

    few = len(choices) <= max(len(_ESTIMATORS), len(_MODELS))
    with _ended_input():
        return Prompt.ask(Text(question), console=console, choices=list(choices), show_choices=few, default=default)


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
