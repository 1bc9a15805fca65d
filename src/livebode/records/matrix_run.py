"""What run.json of a matrix run contains: its entries, and the view of one of them as an ordinary run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from livebode.core import Lines, RecordError
from livebode.records.matrix_table import MatrixShape

_OF_THE_MATRIX = ("outputs", "inputs", "units", "kinds_of_entries")


def is_matrix(summary: Mapping[str, Any]) -> bool:
    """Whether the run has matrices of responses."""
    return bool(summary.get("matrix", False))


def matrix_shape(summary: Mapping[str, Any], lines: Lines) -> MatrixShape:
    """Signals and lines of a matrix run."""
    findings = summary["found"]
    return MatrixShape(lines, tuple(findings["outputs"]), tuple(findings["inputs"]))


def entries_of(summary: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
    """Output and input of each entry, by its name "output/input"; none of an ordinary run."""
    if not is_matrix(summary):
        return {}
    findings = summary["found"]
    return {f"{o}/{i}": (o, i) for o in findings["outputs"] for i in findings["inputs"]}


def entry_named(path: str, summary: Mapping[str, Any], name: str) -> tuple[str, str]:
    """Output and input of the entry of this name; RecordError if there is none."""
    entries = entries_of(summary)
    if not entries:
        raise RecordError(
            "no-matrix",
            f"{path!r} has one response, so it has no entry {name!r}",
            "remove the entry",
            path=path,
            entry=name,
            argument="entry",
        )
    if name not in entries:
        raise RecordError(
            "entry-unknown",
            f"{path!r} has no entry {name!r}",
            f"choose one of {', '.join(entries)}",
            path=path,
            entry=name,
            allowed=list(entries),
            argument="entry",
        )
    return entries[name]


def entry_missing(path: str, summary: Mapping[str, Any]) -> RecordError:
    """The error where one entry is needed, and none was named."""
    entries = list(entries_of(summary))
    return RecordError(
        "entry-missing",
        f"{path!r} has a matrix of {len(entries)} responses, and one of them is needed",
        f"choose an entry: {', '.join(entries)}",
        path=path,
        allowed=entries,
        argument="entry",
    )


def matrix_unsupported(
    path: str, what: str, remedy: str = "run the recording with one output and one input"
) -> RecordError:
    """The error where a whole run with one response is needed, and no entry can be chosen."""
    return RecordError(
        "matrix-unsupported",
        f"{path!r} is a matrix run, and {what} needs a run with one response",
        remedy,
        path=path,
    )


def entry_summary(summary: Mapping[str, Any], output: str, input: str) -> dict[str, Any]:
    """run.json as that of a run with one output and one input."""
    findings = dict(summary["found"])
    o, i = findings["outputs"].index(output), findings["inputs"].index(input)
    own = {"unit": findings["units"][o][i], "kinds": findings["kinds_of_entries"][o][i]}
    findings = {name: value for name, value in findings.items() if name not in _OF_THE_MATRIX} | own
    configuration = dict(summary.get("configuration", {}))
    signals = dict(configuration.get("signals", {}))
    signals.pop("excitation", None)  # all of them belong to every entry
    configuration["signals"] = signals | {"output": output, "input": input}
    monitoring = configuration.get("monitoring")
    if monitoring is not None:  # one response describes no gantry
        configuration["monitoring"] = {name: value for name, value in monitoring.items() if name != "gantry"}
    configuration["loop"] = _loop(configuration.get("loop") or {}, output, input)
    others = {name: value for name, value in summary.items() if name not in ("matrix", "columns")}
    return others | {"configuration": configuration, "found": findings, "entry": f"{output}/{input}"}


def _loop(section: Mapping[str, Any], output: str, input: str) -> dict[str, Any]:
    """[loop] with the controller from this output to this input, if it is described."""
    loop = {name: value for name, value in section.items() if name != "controllers"}
    for controller in section.get("controllers") or []:
        if (controller["output"], controller["input"]) == (output, input):
            loop |= {name: value for name, value in controller.items() if name not in ("output", "input")}
    return loop
