"""`livebode.dataclass` against the standard one: generated classes behave alike."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import FrozenInstanceError, field
from types import ModuleType
from typing import Any, ClassVar  # noqa: F401 - an annotation below names it

import pytest
from hypothesis import given
from hypothesis import strategies as st

from livebode.dataclass import dataclass as own

Decorator = Callable[..., Any]
KINDS = ("required", "default", "factory", "keyword", "inner", "constant")
VALUES = st.sampled_from([None, 0, 1.5, "text", (1, 2)])


def _declared(kind: str) -> Any:
    """What the class body assigns to a field of this kind; `...` if nothing."""
    return {
        "required": ..., "default": 7, "factory": field(default_factory=list), "keyword": field(kw_only=True),
        "inner": field(default=None, init=False, repr=False, compare=False), "constant": 3,
    }[kind]  # fmt: skip


def _class(name: str, kinds: list[str], base: type, methods: dict[str, Any], decorate: Decorator) -> Any:
    names = [f"{name.lower()}{number}_{kind}" for number, kind in enumerate(kinds)]
    body = {one: value for one, kind in zip(names, kinds, strict=True) if (value := _declared(kind)) is not ...}
    annotations = {
        one: "ClassVar[int]" if kind == "constant" else "object" for one, kind in zip(names, kinds, strict=True)
    }
    space = {"__annotations__": annotations, "__module__": __name__, "__doc__": "A class.", **body, **methods}
    return decorate(type(name, (base,), space))


def _after(self: Any) -> None:
    object.__setattr__(self, "counted", len(vars(self)))


METHODS: dict[str, Any] = {
    "__post_init__": _after,
    "__repr__": lambda _: "shown",
    "__eq__": lambda one, other: type(other) is type(one),
    "__hash__": lambda _: 5,
}


@st.composite
def pairs(draw: Any) -> tuple[Any, Any]:
    """A class with a base, made by both decorators."""
    options = {name: draw(st.booleans()) for name in ("eq", "frozen", "repr")}
    # A field without a default must not follow one with a default.
    order = ["required", *KINDS[1:]]
    bodies = [sorted(draw(st.lists(st.sampled_from(order), max_size=4)), key=order.index) for _ in range(2)]
    if {"default", "factory"} & {*bodies[0]}:
        bodies[1] = [kind for kind in bodies[1] if kind != "required"]
    methods = [{name: METHODS[name] for name in draw(st.sets(st.sampled_from(sorted(METHODS))))} for _ in range(2)]
    kw_only = draw(st.booleans())

    def made(decorate: Decorator) -> Any:
        base = _class("Base", bodies[0], object, methods[0], decorate(**options))
        return _class("Own", bodies[1], base, methods[1], decorate(kw_only=kw_only, **options))

    return made(dataclasses.dataclass), made(own)


def _result(action: Callable[[], Any]) -> Any:
    try:
        return action()
    except (TypeError, FrozenInstanceError, AttributeError) as error:
        return type(error)


def _facts(cls: Any, positional: list[Any], named: dict[str, Any]) -> Iterator[Any]:
    """What both classes must have in common."""
    yield [
        (one.name, one.type, one.init, one.repr, one.compare, one.kw_only, one.default)
        for one in dataclasses.fields(cls)
    ]
    parameters = inspect.signature(cls).parameters.values()
    yield [(one.name, one.kind, one.annotation, one.default is inspect.Parameter.empty) for one in parameters]
    yield cls.__match_args__
    first, second = (_result(lambda: cls(*positional, **named)) for _ in range(2))
    if isinstance(first, type):
        yield first
        return
    yield re.sub(" at 0x.*", "", repr(first))
    yield first == second
    yield first == object()
    yield _result(lambda: hash(first) if cls.__hash__ is not object.__hash__ else None)
    yield dataclasses.asdict(first)
    yield vars(first)
    yield _result(lambda: vars(dataclasses.replace(first)))
    yield vars(copy.copy(first)), vars(copy.deepcopy(first))
    for name in (*vars(first), "another"):
        yield _result(lambda name=name: setattr(first, name, 1))
        yield _result(lambda name=name: delattr(first, name))


@given(pair=pairs(), positional=st.lists(VALUES, max_size=4), data=st.data())
def test_a_generated_class_is_as_the_standard_one(pair: tuple[Any, Any], positional: list[Any], data: Any) -> None:
    standard, light = pair
    names = list(inspect.signature(standard).parameters)
    named = {name: data.draw(VALUES) for name in names[len(positional) :] if data.draw(st.integers(0, 4))}
    assert list(_facts(light, positional, named)) == list(_facts(standard, positional, named))


@own(frozen=True)
class Stored:
    """Is pickled by its name."""

    value: int
    more: list[int] = field(default_factory=list)


def test_an_object_survives_pickling() -> None:
    assert pickle.loads(pickle.dumps(Stored(3, [4]))) == Stored(3, [4])


def test_a_standard_dataclass_inherits_from_it_and_the_other_way_round() -> None:
    @dataclasses.dataclass(frozen=True)
    class Below(Stored):
        below: int = 0

    @own(frozen=True)
    class Lowest(Below):
        lowest: int = 0

    assert Lowest(1, [], 2, 3) == Lowest(1, [], 2, 3) != Lowest(1, [], 2, 4)
    assert repr(Lowest(1)).endswith("Lowest(value=1, more=[], below=0, lowest=0)")


def test_a_mutable_default_is_refused() -> None:
    @own
    class Shared:
        values: list[int] = []  # noqa: RUF012

    with pytest.raises(ValueError, match="default_factory"):
        Shared()


def test_a_class_without_an_instance_compiles_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    module = ModuleType("loaded_only")
    monkeypatch.setitem(sys.modules, "loaded_only", module)
    code = "@dataclass(frozen=True)\nclass Unused:\n    value: int = 0\n"
    module.__dict__["dataclass"] = own
    exec(code, module.__dict__)
    assert not inspect.isfunction(vars(module.__dict__["Unused"])["__init__"])
    assert module.__dict__["Unused"](1).value == 1
    assert inspect.isfunction(vars(module.__dict__["Unused"])["__init__"])
