"""Data that a table accepts without pydantic: pydantic accepts it too, with the same values, and writes the same."""

from __future__ import annotations

import copy
import math
import pickle
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError

from livebode.configuration import Axis, File, LimitSection, LoopSection, MachineSection, MonitoringSection
from livebode.configuration.section import Language, Positive
from livebode.core import TypedTable
from livebode.core.typed_table import fields_of
from livebode.core.typed_table_model import model_of, validated
from livebode.core.typed_values import NotPlainError
from livebode.records.summary_shape import _AnySummary, _MatrixFound, _Summary
from livebode.sources.live import SourceSettings

TABLES: tuple[Any, ...] = (Axis, SourceSettings, LoopSection, LimitSection, MonitoringSection, _Summary, _MatrixFound)
WORDS = st.sampled_from(
    ["", "y", "u", "auto", "direct", "before", "resonance_hz", "|G|", "si", "5000 samples", "2 x", "a/b", "rpm", "1\n"]
)
SCALARS = st.one_of(
    st.none(), st.booleans(), st.integers(-3, 5), st.sampled_from([1 << 53, 1 << 70, 4000]),
    st.floats(allow_nan=True, allow_infinity=True), WORDS, st.just(Path("file")),
)  # fmt: skip
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(WORDS, inner, max_size=3) | st.tuples(inner, inner),
    max_leaves=6,
)


def _data(table: Any, depth: int = 2) -> st.SearchStrategy[dict[str, Any]]:
    """Data with keys of the table, whose inner tables are alike."""

    def value(kind: Any) -> st.SearchStrategy[Any]:
        inner = [each for each in (kind, *getattr(kind, "__args__", ())) if hasattr(each, "of_plain")]
        if inner and depth:
            return st.one_of(_data(inner[0], depth - 1), _data(inner[0], depth - 1), VALUES)
        return VALUES

    keys = {field.key: value(field.kind) for field in fields_of(table).values()}
    return st.lists(st.sampled_from(sorted(keys)), unique=True, max_size=4).flatmap(
        lambda names: st.fixed_dictionaries({name: keys[name] for name in names})
    )


@pytest.mark.parametrize("table", TABLES)
@settings(suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much])
@given(data=st.data())
def test_what_is_accepted_at_once_is_what_pydantic_reads(table: Any, data: Any) -> None:
    given = data.draw(_data(table))
    if table is Axis:
        given = {"source": {"log": "a.csv"}, "signals": {"output": "y"}} | given
    try:
        plain = table.of_plain(copy.deepcopy(given))
    except NotPlainError:
        return
    other = validated(table, given)
    assert repr(plain) == repr(other)  # also the types, as 1.0 and 1
    assert plain.model_fields_set == other.model_fields_set


AXES = st.fixed_dictionaries(
    {
        "source": st.fixed_dictionaries(
            {"log": st.sampled_from(["a.csv", Path("b.csv"), ["a.csv", "b.csv"]])},
            optional={"from": st.sampled_from([2, 2.5, "3 periods"]), "rate_hz": st.floats(1, 9), "kinds": st.just({})},
        ),
        "signals": st.fixed_dictionaries(
            {"output": st.sampled_from(["y", ["y"], ["y", "z"]])}, optional={"input": WORDS, "schedule": st.none()}
        ),
    },
    optional={
        "lines": st.fixed_dictionaries({}, optional={"window": st.sampled_from(["auto", 400]), "frequencies": WORDS}),
        "loop": st.just({"velocity": {"gain": 1, "rate_hz": 4000}}),
        "machine": st.just({"site": "Graz"}),
        "report": st.sampled_from([{}, {"limits": [{"quantity": "|G|", "max": 3, "band_hz": [1, 2]}]}]),
        "monitoring": st.sampled_from([{}, {"baseline": "b.json", "covariates": []}]),
        "record": st.sampled_from([None, {}]),
    },
)


@given(
    given=AXES,
    options=st.fixed_dictionaries(
        {"mode": st.sampled_from(["json", "python"]), "by_alias": st.booleans()},
        optional={name: st.booleans() for name in ("exclude_unset", "exclude_defaults", "exclude_none")}
        | {"exclude": st.sets(st.sampled_from(["source", "lines", "loop"]))}
        | {"include": st.sets(st.sampled_from(["source", "signals", "report"]))},
    ),
)
def test_plain_data_of_a_table_is_that_of_its_model(given: dict[str, Any], options: dict[str, Any]) -> None:
    try:
        axis = Axis.model_validate(given)
    except ValueError:
        return
    options = {name: option for name, option in options.items() if name in ("mode", "by_alias") or option}
    for table in filter(None, (axis, axis.source, axis.signals, axis.loop.velocity, axis.monitoring, axis.report)):
        model = model_of(type(table)).model_construct(table.model_fields_set, **dict(table))
        assert _finite(table.model_dump(**options)) == _finite(model.model_dump(**options))


def _finite(value: Any) -> Any:
    """With None for infinity, as of a table in a model of pydantic."""
    if isinstance(value, dict):
        return {name: _finite(each) for name, each in value.items()}
    return None if value == math.inf else value


def test_a_table_is_equal_to_its_copies() -> None:
    axis = Axis.model_validate({"source": {"log": "a.csv"}, "signals": {"output": "y"}})
    for other in (pickle.loads(pickle.dumps(axis)), copy.deepcopy(axis), copy.copy(axis)):
        assert other == axis
        assert other.model_fields_set == axis.model_fields_set
    assert axis.model_copy(update={"machine": MachineSection(site="Graz")}) != axis


def test_a_table_cannot_be_changed() -> None:
    with pytest.raises(AttributeError, match="site"):
        MachineSection().site = "Graz"


def test_lists_of_defaults_are_not_shared() -> None:
    first, second = (MonitoringSection() for _ in range(2))
    first.covariates.append("temperature")
    assert second.covariates == []


def test_run_json_is_checked_with_its_further_keys() -> None:
    table: type[TypedTable] = _AnySummary
    assert table.model_validate({"counts": {"samples": 3}, "more": [1]}).model_fields_set == {"counts"}


class _Settings(BaseModel, strict=True):
    """The settings of a plug-in, by pydantic alone."""

    file: File
    rate_hz: Positive = 1.0
    language: Language = "en"


def test_a_model_of_a_plugin_may_have_types_of_ours() -> None:
    settings = _Settings.model_validate({"file": "recipe.toml", "rate_hz": 2.0, "language": "de"})
    assert settings == _Settings(file=Path("recipe.toml"), rate_hz=2.0, language="de")
    for wrong in ({"file": 3}, {"file": "a", "rate_hz": 0.0}, {"file": "a", "language": "xx"}):
        with pytest.raises(ValidationError):
            _Settings.model_validate(wrong)
