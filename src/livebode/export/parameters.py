"""parameters.parquet: parameters of the models fitted to the responses, one row for each time and parameter."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np

from livebode.core import OutputError, RecordError, needing
from livebode.dataclass import dataclass
from livebode.export.delimited import write_columns, write_header
from livebode.export.matlab import VARIABLE
from livebode.export.result import VALUES_MAX, WriteResult
from livebode.tables import Table

COLUMNS = ("time_s", "schedule", "name", "value", "sigma", "unit", "model", "status")
_WORDS = ("name", "unit", "model", "status")


@dataclass(frozen=True)
class ParameterTable:
    """The table of parameters of a run, in parts of bounded size. Iterate over it as often as needed.

    `tables` gives its rows, as `livebode.records.Run.tables` does.

    Raises
    ------
    RecordError
        If the run has none, or the table cannot be read or lacks a column.
    """

    run: Path
    tables: Callable[[], Iterable[Table]]

    def __iter__(self) -> Iterator[Table]:
        any_ = False
        for table in self.tables():
            any_ = True
            missing = [column for column in COLUMNS if column not in table.column_names]
            if missing:
                raise RecordError(
                    "unexpected-content",
                    f"the parameters of {str(self.run)!r} have no column {missing[0]!r}",
                    "run the recording again",
                    path=str(self.run),
                    column=missing[0],
                )
            yield table.select(COLUMNS)
        if not any_:
            raise RecordError(
                "no-parameters",
                f"the run {str(self.run)!r} has no parameters: no model was fitted to its responses",
                "fit one to its mean response, or run the recording again with a model",
                path=str(self.run),
            )


def write_parameters_csv(path: Path, parts: Iterable[Table]) -> WriteResult:
    """Write parameters in long form, part by part, with the names of `COLUMNS`; units have their own column.

    Raises
    ------
    RecordError
        If there are none.
    """
    rows: int | None = None
    with path.open("wb") as file:
        for part in parts:
            if rows is None:
                rows = 0
                write_header(file, COLUMNS)
            write_columns(file, [part.text(name).to_list() if name in _WORDS else part[name] for name in COLUMNS])
            rows += part.num_rows
        if rows is None:
            raise RecordError(
                "no-parameters", "the run has no parameters to export", "run the recording again with a model"
            )
    return WriteResult(rows)


def write_parameters_mat(path: Path, parts: Iterable[Table]) -> WriteResult:
    """Write parameters as a MATLAB struct `livebode` of columns, for `struct2table`; text is in cells.

    Raises
    ------
    RecordError
        If there are none.
    OutputError
        If there are more than `VALUES_MAX`.
    """
    with needing("SciPy", "analysis", "an export for MATLAB"):
        from scipy.io import savemat

    kept: list[Table] = []
    for part in parts:
        kept.append(part)
        if sum(p.num_rows for p in kept) > VALUES_MAX:
            raise OutputError(
                "too-large",
                f"the run has more than {VALUES_MAX} parameters, too many for a MATLAB file",
                "export csv, which is written in parts",
                format="mat",
                limit=VALUES_MAX,
            )
    table = Table.join(kept) if kept else None
    if table is None or not table.num_rows:
        raise RecordError(
            "no-parameters", "the run has no parameters to export", "run the recording again with a model"
        )
    columns = {name: table.values(name)[:, np.newaxis] for name in COLUMNS}
    savemat(path, {VARIABLE: columns}, appendmat=False, do_compression=True)
    return WriteResult(table.num_rows)
