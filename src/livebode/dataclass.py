"""`dataclass` as of the standard library, whose methods are made when they are first used.

The standard one compiles up to six functions for each class while its module is loaded, and a command uses few of the
classes that it loads. What a method does is the same, and `dataclasses.fields`, `asdict` and `replace` work. Only what
livebode uses is here: neither `order` and `slots` nor `InitVar`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import _FIELD, MISSING, Field, FrozenInstanceError, field  # type: ignore[attr-defined]
from functools import partial
from operator import attrgetter
from reprlib import recursive_repr
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # whatever knows the standard one knows this one
    from dataclasses import dataclass as dataclass
else:

    def dataclass(cls=None, /, *, repr=True, eq=True, frozen=False, kw_only=False):
        """Make a class whose fields are its annotations, as `dataclasses.dataclass` with these options."""
        if cls is None:
            return partial(dataclass, repr=repr, eq=eq, frozen=frozen, kw_only=kw_only)
        own = vars(cls)
        given = {name: own[name] for name in own.get("__annotations__", ()) if type(own.get(name)) is Field}
        for name, declared in given.items():
            if declared.default is MISSING:
                delattr(cls, name)
            else:
                setattr(cls, name, declared.default)
        cls.__dataclass_params__ = SimpleNamespace(
            init=True, repr=repr, eq=eq, order=False, unsafe_hash=False, frozen=frozen
        )
        deferred = {"__init__": _init, "__match_args__": _match_args}
        if repr:
            deferred["__repr__"] = _repr
        if eq:
            deferred["__eq__"] = _eq
            if own.get("__hash__") is None and ("__hash__" not in own or "__eq__" in own):
                cls.__hash__ = _Deferred(cls, "__hash__", _hash) if frozen else None
        for name, make in deferred.items():
            if name not in own:
                setattr(cls, name, _Deferred(cls, name, make))
        cls.__dataclass_fields__ = _Deferred(cls, "__dataclass_fields__", partial(_fields, given, kw_only))
        if frozen:
            cls.__setattr__, cls.__delattr__ = _refusals(cls)
        return cls


class _Deferred:
    """An attribute of a class that is made at its first use."""

    __slots__ = ("_cls", "_make", "_name")

    def __init__(self, cls: type, name: str, make: Callable[[type], Any]) -> None:
        self._cls, self._name, self._make = cls, name, make

    def __get__(self, instance: object, owner: type | None = None) -> Any:
        made = self._make(self._cls)
        setattr(self._cls, self._name, made)
        return made.__get__(instance, owner) if hasattr(made, "__get__") else made


def _fields(given: dict[str, Any], kw_only: bool, cls: Any) -> dict[str, Any]:
    """The fields by name, those of the bases first; of its own some are `given`, others have a default or none."""
    fields: dict[str, Any] = {}
    for base in cls.__mro__[-1:0:-1]:
        fields |= getattr(base, "__dataclass_fields__", {})
    for name, kind in vars(cls).get("__annotations__", {}).items():
        if str(kind).removeprefix("typing.").startswith("ClassVar"):
            continue
        one: Any = given.get(name) or field(default=getattr(cls, name, MISSING))
        if one.default.__class__.__hash__ is None:
            raise ValueError(
                f"mutable default {type(one.default)} for field {name} is not allowed: use default_factory"
            )
        one.name, one.type, one._field_type = name, kind, _FIELD
        if one.kw_only is MISSING:
            one.kw_only = kw_only
        fields[name] = one
    return fields


def _init(cls: Any) -> Any:
    """`__init__`, as a person would write it: assignments in the order of the fields."""
    fields = list(cls.__dataclass_fields__.values())
    known: dict[str, Any] = {"_set": object.__setattr__, "_missing": MISSING}
    body = [_assignment(one, cls.__dataclass_params__.frozen, known) for one in fields]
    if hasattr(cls, "__post_init__"):
        body.append("_self.__post_init__()")
    taken = [(one.kw_only, one.name + _default(one)) for one in fields if one.init]
    keywords = [text for kw_only, text in taken if kw_only]
    parameters = ", ".join(
        ["_self", *(text for kw_only, text in taken if not kw_only), *["*"] * bool(keywords), *keywords]
    )
    lines = "".join(f"\n  {line}" for line in body or ["pass"])
    space: dict[str, Any] = {}
    text = f"def _make({', '.join(known)}):\n def __init__({parameters}):{lines}\n return __init__"
    exec(text, vars(sys.modules[cls.__module__]), space)
    init = space["_make"](**known)
    init.__qualname__ = f"{cls.__qualname__}.__init__"
    init.__annotations__ = {one.name: one.type for one in fields if one.init} | {"return": None}
    return init


def _default(one: Field[Any]) -> str:
    if one.default_factory is not MISSING:
        return "=_missing"
    return "" if one.default is MISSING else f"=_default_{one.name}"


def _assignment(one: Field[Any], frozen: bool, known: dict[str, Any]) -> str:
    """The line that sets a field; what it needs is added to `known`."""
    value = one.name
    if one.default_factory is not MISSING:
        known[made := f"_make_{one.name}"] = one.default_factory
        value = f"{made}() if {one.name} is _missing else {one.name}" if one.init else f"{made}()"
    elif not one.init:
        return "pass"  # its default remains that of the class
    elif one.default is not MISSING:
        known[f"_default_{one.name}"] = one.default
    return f"_set(_self, {one.name!r}, {value})" if frozen else f"_self.{one.name} = {value}"


def _match_args(cls: Any) -> tuple[str, ...]:
    return tuple(one.name for one in cls.__dataclass_fields__.values() if one.init and not one.kw_only)


def _repr(cls: Any) -> Any:
    names = [one.name for one in cls.__dataclass_fields__.values() if one.repr]

    @recursive_repr()
    def shown(self: Any) -> str:
        return f"{type(self).__qualname__}({', '.join(f'{name}={getattr(self, name)!r}' for name in names)})"

    return shown


def _eq(cls: Any) -> Any:
    values = _compared(cls)

    def equal(self: Any, other: Any) -> bool:
        return values(self) == values(other) if other.__class__ is self.__class__ else NotImplemented

    return equal


def _hash(cls: Any) -> Any:
    values = _compared(cls)
    return lambda self: hash(values(self))


def _compared(cls: Any) -> Any:
    """The function that returns the values of an object that equality and hash are about, as a tuple."""
    names = [one.name for one in cls.__dataclass_fields__.values() if one.compare]
    if len(names) > 1:
        return attrgetter(*names)
    return lambda self: tuple(getattr(self, name) for name in names)


def _refusals(cls: Any) -> tuple[Any, Any]:
    """`__setattr__` and `__delattr__` of a frozen class; a subclass that is no dataclass may have attributes."""

    def check(self: object, name: str, what: str) -> None:
        if type(self) is cls or name in cls.__dataclass_fields__:
            raise FrozenInstanceError(f"cannot {what} field {name!r}")

    def assign(self: object, name: str, value: object) -> None:
        check(self, name, "assign to")
        super(cls, self).__setattr__(name, value)

    def delete(self: object, name: str) -> None:
        check(self, name, "delete")
        super(cls, self).__delattr__(name)

    return assign, delete
