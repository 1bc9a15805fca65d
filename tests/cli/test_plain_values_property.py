"""Values that the command line converts at once against Typer, which converts them by pydantic."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import typer
from hypothesis import given
from hypothesis import strategies as st
from typer._coercion import build_runtime_param, resolve_type_descriptor

from livebode.cli.plain_values import LeftToTyperError, plain_value

LIMITS = st.none() | st.integers(-1000, 1000)
NUMBERS = st.integers().map(str) | st.floats().map(str) | st.from_regex(r"\A[-+ 0-9._e,x]{0,9}\Z")
CASES = st.one_of(
    st.tuples(st.just(str), st.text()),
    st.tuples(st.just(bool), st.booleans()),
    st.tuples(st.sampled_from([int, float]), NUMBERS | st.integers() | st.floats(allow_nan=False) | st.booleans()),
    st.tuples(st.just(Path), st.text().filter(lambda text: "\0" not in text) | st.just(Path("some/where"))),
    st.tuples(st.just(list[str]), st.lists(st.text())),
    st.tuples(st.sampled_from([list[int], list[float]]), st.lists(NUMBERS)),
    st.tuples(st.just(list[Path]), st.lists(st.sampled_from(["a", "a//b", ".", ""]))),
)


def _of_typer(value: Any, annotation: Any, info: Any) -> Any:
    parameter: Any = typer.core.TyperArgument(
        param_decls=["value"], type_descriptor=resolve_type_descriptor(annotation, info)
    )
    context = typer.Context(typer.core.TyperCommand(name="command"))
    return build_runtime_param(parameter.type_descriptor).coerce(value, param=parameter, ctx=context)


@given(case=CASES, low=LIMITS, high=LIMITS)
def test_a_plain_value_is_that_of_typer(case: tuple[Any, Any], low: int | None, high: int | None) -> None:
    annotation, value = case
    info = typer.models.OptionInfo(min=low, max=high)
    try:
        plain = plain_value(value, annotation, info)
    except LeftToTyperError:
        return
    other = _of_typer(value, annotation, info)
    assert plain == other
    assert type(plain) is type(other)


@pytest.mark.parametrize("text", ["0", "-12", "3.25", "1e-3", "+5"])
def test_a_usual_number_is_plain(text: str) -> None:
    assert plain_value(text, float, typer.models.OptionInfo()) == float(text)


@pytest.mark.parametrize("option", ["exists", "resolve_path", "writable", "allow_dash"])
def test_a_path_that_is_checked_is_left_to_typer(option: str) -> None:
    with pytest.raises(LeftToTyperError):
        plain_value("missing", Path, typer.models.OptionInfo(**{option: True}))  # type: ignore[arg-type]


def test_a_parser_is_used_and_what_it_refuses_is_left_to_typer() -> None:
    info = typer.models.ArgumentInfo(parser=int)
    assert plain_value(("1", "2"), list[Path], info) == _of_typer(("1", "2"), list[Path], info) == [1, 2]
    with pytest.raises(LeftToTyperError):
        plain_value("many", Path, info)
