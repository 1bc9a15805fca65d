"""The wide form of responses gives them back: rounded to float32, or exactly."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Lines, RecordError, Responses
from livebode.records import in_stored_precision
from livebode_plant.lake.wide_responses import from_wide, to_wide, wide_options, wide_schema
from tests.support.errors import refused
from tests.support.responses import any_responses, made

LINES = Lines((2, 4, 7), 400, 4000.0, quiet=(3, 5, 6))
EXACT = ("first", "sample", "time_s", "valid", "ready")
ROUNDED = ("value", "sigma", "dof", "coherence", "schedule", "input_coherence", "weight", "distortion", "variation")


def found_of(responses: Responses) -> dict[str, Any]:
    lines = responses.lines
    grid = {"bins": list(lines.bins), "quiet_bins": list(lines.quiet), "window": lines.window}
    return grid | {"rate_hz": lines.rate_hz, "quantity": responses.quantity, "unit": responses.unit}


@st.composite
def complete(draw: st.DrawFn) -> Responses:
    """Responses with all that one can have: weights, distortion, rows that are not ready, extreme numbers, no rows."""
    given = draw(any_responses())
    rng, shape = np.random.default_rng(draw(st.integers(0, 999))), given.value.shape
    return replace(
        given,
        input_coherence=np.where(given.valid, rng.random(shape), np.nan),
        weight=rng.standard_normal(shape) + 1j * 10 ** rng.uniform(-300, 300, shape),
        distortion=rng.choice([np.nan, np.inf, 0.0, 1e-9], shape),
        variation=rng.choice([np.nan, 0.0, 1e-9], shape),
        ready=rng.random(len(given)) < 0.5,
        sample=given.sample + draw(st.sampled_from([0, (1 << 62) - 1000])),
        time_s=given.time_s + draw(st.sampled_from([0.0, 1.7e9])),
        quantity=draw(st.sampled_from(["plant", "sensitivity"])),
    )[: draw(st.integers(0, len(given)))]


def as_float32(values: np.ndarray) -> np.ndarray:
    with np.errstate(over="ignore", under="ignore"):
        kind = np.complex64 if values.dtype.kind == "c" else np.float32
        return values.astype(kind).astype(values.dtype)


def written(path: Path, table: pa.Table) -> pa.Table:
    pq.write_table(table, path, **wide_options(table.schema))
    return pq.read_table(path)


@settings(max_examples=60, deadline=None)
@given(responses=complete(), lossless=st.booleans(), stored=st.booleans())
def test_the_wide_form_is_rounded_to_float32_or_exact(
    tmp_path_factory: pytest.TempPathFactory, responses: Responses, lossless: bool, stored: bool
) -> None:
    table = to_wide(responses, lossless=lossless)
    assert table.schema == wide_schema(len(responses.lines), lossless=lossless)
    assert table.num_rows == len(responses)
    if stored:
        table = written(tmp_path_factory.mktemp("wide") / "responses.parquet", table)
    back = from_wide(table, found_of(responses))
    if lossless:
        assert back.equals(responses)
        return
    assert back.equals(in_stored_precision(responses))
    assert (back.lines, back.quantity, back.unit) == (responses.lines, responses.quantity, responses.unit)
    for name in EXACT:
        assert np.array_equal(getattr(back, name), getattr(responses, name)), name
    for name in ROUNDED:
        assert np.array_equal(getattr(back, name), as_float32(getattr(responses, name)), equal_nan=True), name


def test_parts_other_columns_and_other_kinds_of_lists_are_read(tmp_path: Path) -> None:
    """As a lake has them: rows of several files, columns of the archive, lists without a length in their type."""
    responses = made(6, LINES)
    table = to_wide(responses, lossless=True)
    named = table.append_column("content", pa.array(["ab" * 32] * 6)).append_column("row", pa.array(range(6)))
    again = written(tmp_path / "one.parquet", named.select(reversed(named.schema.names)))
    variable = pa.schema([
        pa.field(field.name, pa.list_(field.type.value_type) if pa.types.is_fixed_size_list(field.type) else field.type)
        for field in table.schema
    ])  # fmt: skip
    for other in (again, table.cast(variable), pa.concat_tables([table.slice(0, 2), table.slice(2)])):
        assert from_wide(other, found_of(responses)).equals(responses)
    assert from_wide(table.slice(2, 3), found_of(responses)).equals(responses[2:5])
    assert from_wide(table.cast(variable).slice(2, 3), found_of(responses)).equals(responses[2:5])


def test_a_table_that_is_not_of_this_run_is_refused() -> None:
    responses = made(4, LINES)
    table, found = to_wide(responses), found_of(responses)
    with refused(RecordError, "unexpected-content"):
        from_wide(table, found | {"bins": [2, 4]})
    with refused(RecordError, "unexpected-content"):
        from_wide(table.drop_columns(["sigma"]), found)
    at = table.schema.get_field_index("time_s")
    with refused(RecordError, "unexpected-content"):
        from_wide(table.set_column(at, "time_s", pa.array([0.0, None, 1.0, 2.0])), found)
    at = table.schema.get_field_index("re")
    for rows in ([[1.0, 2.0, 3.0]] * 3 + [None], [[1.0, 2.0, None]] * 4, [[1.0, 2.0, 3.0]] * 3 + [[1.0]]):
        with refused(RecordError, "unexpected-content"):
            from_wide(table.set_column(at, "re", pa.array(rows, pa.list_(pa.float32()))), found)


def test_sql_reads_the_wide_form(tmp_path: Path) -> None:
    import duckdb

    responses = made(20, LINES, hole=0.0)
    path = tmp_path / "wide.parquet"
    written(path, to_wide(responses))
    rows = duckdb.sql(
        f"SELECT sample, re[2], valid[2] FROM '{path}' WHERE coherence[2] > 0.5 ORDER BY sample"
    ).fetchall()
    chosen = responses.coherence[:, 1] > 0.5
    assert [row[0] for row in rows] == responses.sample[chosen].tolist()
    assert [row[1] for row in rows] == as_float32(responses.value.real[chosen, 1]).tolist()
