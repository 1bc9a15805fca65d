"""Rows of results in the tables of a record; `result_rows.register` adds another type of results."""

from __future__ import annotations

from collections.abc import Mapping
from functools import singledispatch
from typing import Any

from livebode.core import Parameters, Responses
from livebode.records.column_table import ColumnTable
from livebode.records.response_table import PARAMETERS, RESPONSES, as_batch, parameter_rows
from livebode.tables import Table

RESPONSE_TABLES: Mapping[str, ColumnTable] = {"responses": RESPONSES, "parameters": PARAMETERS}
"""Tables of a run with single responses."""


@singledispatch
def result_rows(results: Any) -> Mapping[str, Table]:
    """The rows of results by the name of their table."""
    raise TypeError(f"a record has no table for {type(results).__name__}")


@result_rows.register
def _(results: Responses) -> Mapping[str, Table]:
    return {"responses": as_batch(results)}


@result_rows.register
def _(results: Parameters) -> Mapping[str, Table]:
    return {"parameters": parameter_rows(results)}
