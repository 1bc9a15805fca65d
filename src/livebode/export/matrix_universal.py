"""Universal File Format, dataset 58, of matrices: one function for each response and entry, with degrees of freedom."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from livebode.core import MatrixResponses, Response, UsageError
from livebode.export.degrees_of_freedom import DegreeOfFreedom, numbered
from livebode.export.result import WriteResult
from livebode.export.universal import text, write_functions

_ENTITY = 10  # letters of an entity's name


def write_matrix_uff(
    path: Path,
    parts: Iterable[MatrixResponses],
    _about: Mapping[str, Any] | None = None,
    dofs: Mapping[str, str] | None = None,
) -> WriteResult:
    """Write one ASCII dataset 58 for each response and entry: all outputs of the first input, then of the next.

    As `write_uff`, with the degrees of freedom of response (output) and reference (input), and the names of the
    signals as entity names, cut at 10 letters.

    Parameters
    ----------
    dofs
        Node and direction by the name of a signal, such as ``{"velocity1": "12+Z", "u1": "12+RZ"}``. Default: the
        number of the output or of the input as its node, scalar.

    Raises
    ------
    ExtraError
        If pyuff is not installed.
    UsageError
        If `dofs` has the name of no signal, or a text that is not a degree of freedom.
    SignalError
        If no entry has two valid lines.
    """
    return write_functions(path, _functions(parts, {n: DegreeOfFreedom.parse(t) for n, t in (dofs or {}).items()}))


def _functions(
    parts: Iterable[MatrixResponses], given: Mapping[str, DegreeOfFreedom]
) -> Iterator[tuple[Response, str, Mapping[str, Any]]]:
    for part in parts:
        _check(part, given)
        outputs = list(zip(part.outputs, numbered(part.outputs, given)))
        inputs = list(zip(part.inputs, numbered(part.inputs, given)))
        entries = {(o, i): part.entry(o, i) for o, _ in outputs for i, _ in inputs}
        for row in range(len(part)):
            for input, reference in inputs:
                for output, response in outputs:
                    fields = {
                        "rsp_ent_name": text(output, _ENTITY),
                        "rsp_node": response.node,
                        "rsp_dir": response.direction,
                        "ref_ent_name": text(input, _ENTITY),
                        "ref_node": reference.node,
                        "ref_dir": reference.direction,
                    }
                    yield entries[output, input][row], f"from {input} to {output}", fields


def _check(part: MatrixResponses, given: Mapping[str, DegreeOfFreedom]) -> None:
    names = (*part.outputs, *part.inputs)
    for name in given:
        if name not in names:
            raise UsageError(
                "unknown-name",
                f"{name!r} is not one of the signals",
                f"choose {', '.join(map(repr, names))}",
                argument="dofs",
                value=name,
                allowed=list(names),
            )
