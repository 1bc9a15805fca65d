"""The tasks beside measuring: what each asks for, the command that does it, and where its result is.

A task starts a command by its name; one whose wing is not installed is not offered.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import field
from functools import cache
from pathlib import Path
from typing import Any

import tomli_w

from livebode.core import ServerError, UsageError, write_whole, writing
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode.plugins import named
from livebode_start.jobs import JobOrder
from livebode_start.task_fields import TaskField, key_fields, option_fields, toml_value
from livebode_start.workspace import file_name

TEXT_LETTERS_MAX = 1000
LIMITS_MAX = 50
FIRST_PAGE = ("--machine", "--serial-number", "--operator", "--company", "--customer", "--conditions", "--paper")
_OF_THE_PAGE = {"compare": {"--language"}, "report": {"--language"}}
"""Options that the page sets itself."""
_LIMIT = tuple(f"report.limits.{key}" for key in ("quantity", "min", "max", "band_hz"))
_EXCITATION = ("--band", "--resolution", "--lines", "--amplitude", "--accuracy", "--seed")
_LIMITS = (
    "limits.torque_n_m_max", "limits.speed_m_per_s_max", "limits.following_error_m_max",
    "limits.position_m_min", "limits.position_m_max",
)  # fmt: skip
_MEASURED = (
    "measured.output", "measured.radius_m", "measured.noise", "measured.torque_n_m", "measured.speed_m_per_s",
    "measured.position_m", "measured.following_error_m",
)  # fmt: skip
_LOOP = (
    "loop.velocity.gain", "loop.velocity.integral_time_s", "loop.velocity.rate_hz",
    "loop.position.gain", "loop.position.rate_hz",
)  # fmt: skip
_BELT = (
    "belt.mechanics.inertia_kg_m2", "belt.mechanics.load_kg", "belt.mechanics.radius_m",
    "belt.mechanics.stiffness_n_per_m", "belt.drive.rate_hz", "belt.drive.torque_n_m_max",
    "belt.drive.velocity_gain_n_m_s", "belt.drive.integral_time_s", "belt.drive.position_gain_per_s",
    "belt.sensor.noise_rad_per_s",
)  # fmt: skip


@dataclass(frozen=True)
class TaskRequest:
    """What a person has chosen; the names of runs are those of the list of the server.

    Attributes
    ----------
    directory
        Of the runs.
    runs
        The chosen ones, the earliest first.
    name
        Of the result.
    values
        Texts of the fields that were filled, by their names.
    limits
        Rows of limits of a report, each with some of quantity, min, max and band_hz.
    """

    directory: Path
    runs: tuple[str, ...] = ()
    name: str = ""
    values: Mapping[str, str] = field(default_factory=dict)
    limits: tuple[Mapping[str, str], ...] = ()


@dataclass(frozen=True)
class Task:
    """A task.

    Attributes
    ----------
    command
        Name of the command.
    runs
        Fewest and most runs that it needs.
    fields
        What it asks for.
    order
        The job of a request.
    folder
        Where results with a name of their own are; empty if they are in the directory of the run.
    """

    command: str
    runs: tuple[int, int]
    fields: Callable[[], list[TaskField]]
    order: Callable[[TaskRequest], JobOrder]
    folder: str = ""


def _options(request: TaskRequest, task: str) -> list[str]:
    """The filled fields of a task that are options, each as one word, so that no text becomes another option."""
    flags = {known.name for known in fields_of(task) if known.kind == "flag"}
    return [
        name if name in flags else f"{name}={text}" for name, text in request.values.items() if name.startswith("--")
    ]


def _positional(names: tuple[str, ...]) -> list[str]:
    return ["--", *names]


def _learn(request: TaskRequest) -> JobOrder:
    place = f"baselines/{file_name(request.name)}.json"
    words = ["learn", f"--out={place}", *_options(request, "learn"), *_positional(request.runs)]
    return JobOrder("learn", tuple(words), lambda: _folder(request, "baselines"))


def _compare(request: TaskRequest) -> JobOrder:
    place = f"comparisons/{file_name(request.name)}"
    words = ["compare", f"--out={place}", *_options(request, "compare"), *_positional(request.runs)]
    return JobOrder("compare", tuple(words), lambda: _folder(request, "comparisons"))


def _report(request: TaskRequest) -> JobOrder:
    (run,) = request.runs
    template = f"reports/{run}.toml"
    words = ["report", *_options(request, "report")]
    if request.limits:
        words.append(f"--template={template}")

    def prepare() -> None:
        if request.limits:
            _write_toml(request, template, {"report": {"limits": [_limit(row) for row in request.limits]}})

    return JobOrder("report", (*words, *_positional(request.runs)), prepare)


@cache
def limit_fields() -> tuple[TaskField, ...]:
    """What a report asks for of each limit."""
    return tuple(key_fields("axis", _LIMIT))


def _limit(row: Mapping[str, str]) -> dict[str, Any]:
    keys = {known.name: known.name.rpartition(".")[2] for known in limit_fields()}
    return {keys[known.name]: toml_value(known, row[known.name]) for known in limit_fields() if row.get(known.name)}


def _design(request: TaskRequest) -> JobOrder:
    name = file_name(request.name)
    place, described = f"designs/{name}", f"designs/{name}.toml"
    words = ["design", f"--out={place}", *_options(request, "design"), *_positional((described,))]
    machine: dict[str, Any] = {"measured": {"run": f"../{request.runs[0]}"}} if request.runs else {"belt": {}}
    tables: dict[str, Any] = {"excitation": {}} | machine
    known = {known.name: known for known in fields_of("design")}
    for key, text in request.values.items():
        if key.startswith("--"):
            continue
        *path, last = key.split(".")
        table = tables
        if path[0] in (("belt",) if request.runs else ("measured", "loop")):
            continue  # of the other way to describe the machine
        for part in path:
            table = table.setdefault(part, {})
        table[last] = toml_value(known[key], text)

    def prepare() -> None:
        if not (request.directory / place).exists():  # else the command says so, and the earlier file remains
            _write_toml(request, described, tables)

    return JobOrder("design", tuple(words), prepare)


def _folder(request: TaskRequest, name: str) -> None:
    folder = request.directory / name
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    if folder.is_symlink():
        raise ServerError("file-unknown", f"{name!r} is a link, perhaps to another directory", "remove it", name=name)


def _write_toml(request: TaskRequest, name: str, tables: Mapping[str, Any]) -> None:
    _folder(request, name.partition("/")[0])
    path = request.directory / name
    with writing(path):
        write_whole(path, tomli_w.dumps(tables).encode())


TASKS: Mapping[str, Task] = {
    "compare": Task(
        "compare", (2, 2),
        lambda: option_fields("compare", ["--ignore-below", *FIRST_PAGE, "--appendix"]), _compare, "comparisons",
    ),
    "learn": Task("learn", (1, 1000), lambda: option_fields("learn", ["--reason"]), _learn, "baselines"),
    "report": Task("report", (1, 1), lambda: option_fields("report", [*FIRST_PAGE, "--appendix"]), _report),
    "design": Task(
        "design", (0, 1),
        lambda: [
            *option_fields("design", _EXCITATION),
            *key_fields("experiment", (*_LIMITS, *_MEASURED, *_LOOP, *_BELT)),
        ],
        _design, "designs",
    ),
}  # fmt: skip


def texts() -> set[str]:
    """Help and defaults of all fields that are words, which the page shows in its language."""
    every = [*limit_fields(), *(known for name in TASKS for known in fields_of(name))]
    return {text for known in every for text in (known.help, known.default) if re.search("[a-z]{3}", text)}


def offered() -> list[str]:
    """The tasks whose commands are installed."""
    return [name for name, task in TASKS.items() if task.command in named("commands")]


def task_named(name: object) -> Task:
    """A task; ServerError if it is not offered."""
    if not isinstance(name, str) or name not in offered():
        shown = name[:40] if isinstance(name, str) else ""
        raise ServerError(
            "task-unknown",
            Message("the task {name} is not offered here", name=repr(shown)),
            Message("install the wing of livebode that has its command"),
            task=shown,
        )
    return TASKS[name]


@cache
def fields_of(name: str) -> tuple[TaskField, ...]:
    """What a task asks for."""
    return tuple(TASKS[name].fields())


def check_request(name: str, request: TaskRequest) -> None:
    """UsageError or ServerError for a request that no form of this task sends."""
    fewest, most = TASKS[name].runs
    if not fewest <= len(request.runs) <= most:
        raise UsageError(
            "wrong-shape",
            Message("{count} runs are chosen, and this task needs {needed}", count=len(request.runs),
                    needed=fewest if fewest == most else f"{fewest} … {most}"),
            Message("choose them in the list"),
            argument="runs",
        )  # fmt: skip
    known = {known.name for known in fields_of(name)} | _OF_THE_PAGE.get(name, set())
    texts = [*request.values.values(), *(text for row in request.limits for text in row.values())]
    wrong = [key for key in request.values if key not in known]
    if wrong or len(request.limits) > LIMITS_MAX or not all(_is_text(text) for text in texts):
        raise ServerError(
            "request-malformed", "a field of the request is not one of the form, or its text is too long",
            Message("reload the page"), fields=[key[:80] for key in wrong[:5]],
        )  # fmt: skip


def _is_text(text: object) -> bool:
    """Whether it can be an argument and in a TOML file: no null, no half of a letter."""
    return isinstance(text, str) and len(text) <= TEXT_LETTERS_MAX and "\0" not in text and text.isprintable()
