"""Every batch of rows, found as the subclasses of their base, is cut, joined and compared alike."""

from __future__ import annotations

import importlib
import pkgutil
from dataclasses import fields, replace
from typing import Any, get_args, get_type_hints

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import livebode
from livebode.core import Lines, Parameters, Responses, RowArrays, UsageError
from tests.support.errors import refused

for module in pkgutil.walk_packages(livebode.__path__, "livebode."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
KINDS = sorted(RowArrays.__subclasses__(), key=lambda kind: kind.__name__)
SHARED = {Lines: Lines((1, 2), 10, 100.0), str: "one", tuple[str, ...]: ("one", "two")}
VALUES: dict[Any, list[Any]] = {
    np.float64: [0.0, -0.0, 1.5, np.nan, np.inf], np.complex128: [0j, complex(np.nan, 1), 1 - 2j],
    np.int64: [-1, 0, 1 << 62], np.bool_: [False, True], np.str_: ["ok", "none", "a long reason"],
}  # fmt: skip
every_kind = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
few = settings(max_examples=30, deadline=None)


@st.composite
def batches(draw: st.DrawFn, kind: type[RowArrays], least: int = 0) -> RowArrays:
    """Rows of this kind, with arrays of any values and further axes."""
    hints, rows = get_type_hints(kind), draw(st.integers(least, 12))
    rng = np.random.default_rng(draw(st.integers(0, 1 << 32)))
    values: dict[str, Any] = {}
    for field in fields(kind):  # type: ignore[arg-type]
        hint = hints[field.name]
        if field.name in kind._SHARED:
            values[field.name] = SHARED[hint] if hint in SHARED else get_args(hint)[0]
        else:
            parts = get_args(hint)  # NDArray[type] since NumPy 2.5, before that ndarray[shape, dtype[type]]
            scalar = parts[0] if len(parts) == 1 else get_args(parts[1])[0]
            shape = (rows, *(2, 3)[: rng.integers(3)])
            values[field.name] = rng.choice(np.array(VALUES.get(scalar, VALUES[np.str_])), shape)
    return kind(**values)


def bits(batch: RowArrays) -> dict[str, Any]:
    return {
        name: (a.dtype, a.shape, a.tobytes()) if isinstance(a, np.ndarray) else a for name, a in vars(batch).items()
    }


def test_the_batches_are_found() -> None:
    names = {kind.__name__ for kind in KINDS}
    assert names >= {"Responses", "Parameters", "Margins", "WindowRows", "Evidence", "TrendRows", "MeasuredRows"}


@every_kind
@given(st.data())
@few
def test_the_parts_of_a_cut_join_to_the_whole(kind: type[RowArrays], data: st.DataObject) -> None:
    whole = data.draw(batches(kind))
    edges = sorted(data.draw(st.lists(st.integers(0, len(whole)), max_size=4)))
    parts = [whole[a:b] for a, b in zip([0, *edges], [*edges, len(whole)])]
    assert sum(map(len, parts)) == len(whole)
    joined = kind.join(parts)
    assert bits(joined) == bits(whole)
    assert joined.equals(whole)
    assert not any(
        np.shares_memory(vars(joined)[name], a) for name, a in vars(whole).items() if isinstance(a, np.ndarray)
    )


@every_kind
@given(st.data())
@few
def test_brackets_choose_the_same_rows_of_every_array(kind: type[RowArrays], data: st.DataObject) -> None:
    whole = data.draw(batches(kind, least=1))
    mask = np.array(data.draw(st.lists(st.booleans(), min_size=len(whole), max_size=len(whole))))
    for at in (mask, np.flatnonzero(mask), slice(None, None, 2)):
        some = whole[at]
        assert type(some) is kind
        for name, array in vars(whole).items():
            expected = array if name in kind._SHARED else array[at]
            np.testing.assert_array_equal(vars(some)[name], expected)


@every_kind
@given(st.data())
@few
def test_a_batch_with_one_other_value_is_not_equal(kind: type[RowArrays], data: st.DataObject) -> None:
    whole = data.draw(batches(kind, least=1))
    for name in kind._ARRAYS:
        other = whole[:]
        array = vars(other)[name].copy()
        array.flat[-1] = {"U": "other", "b": not array.flat[-1]}.get(array.dtype.kind, 7)
        assert not replace(other, **{name: array}).equals(whole), name  # type: ignore[type-var]
    assert not whole[:-1].equals(whole)


@every_kind
def test_no_part_is_refused(kind: type[RowArrays]) -> None:
    with refused(UsageError, "missing", argument="parts"):
        kind.join([])


@pytest.mark.parametrize("kind", [Responses, Parameters])
@given(st.data())
@settings(max_examples=5, deadline=None)
def test_parts_that_differ_in_what_all_rows_share_are_not_joined(kind: type[RowArrays], data: st.DataObject) -> None:
    one = data.draw(batches(kind))
    shared = kind._SHARED[-1]
    other = replace(one, **{shared: type(vars(one)[shared])("other")})  # type: ignore[type-var]
    assert not one.equals(other)
    with pytest.raises(ValueError, match="cannot be joined"):
        kind.join([one, other])
