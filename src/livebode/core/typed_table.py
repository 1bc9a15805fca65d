"""TypedTable: a table of a configuration or of run.json, whose keys have types.

A class is written as a model of pydantic, and a type checker sees one. Data that is plainly valid is accepted without
it. pydantic decides about other data and words what is wrong: it and its model of a class take longer to load and to
build than a short run takes, so that they are made when they are needed.
"""

from __future__ import annotations

import copy
import sys
from collections.abc import Collection, Iterator, Mapping
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, ClassVar

from livebode.core.typed_values import REQUIRED, NotPlainError, Specification, plain_value


class TableField:
    """A key of a table: its name in Python and as data, its default and its type, which is read when it is used."""

    def __init__(self, owner: type, name: str, given: Any) -> None:
        specified = given if isinstance(given, Specification) else Specification(default=given)
        self.name, self.key, self.default = name, specified.alias or name, specified.default
        self._owner = owner

    @cached_property
    def kind(self) -> Any:
        """The type of the key."""
        return eval(vars(self._owner)["__annotations__"][self.name], vars(sys.modules[self._owner.__module__]))

    def own_default(self) -> Any:
        """The default for one object; NotPlainError if there is none."""
        if self.default is REQUIRED:
            raise NotPlainError
        return copy.copy(self.default) if isinstance(self.default, list | dict) else self.default


@cache
def fields_of(table: Any) -> dict[str, TableField]:
    """The keys of a table by their names in Python."""
    found: dict[str, TableField] = {}
    for base in reversed(table.__mro__):
        if issubclass(base, TypedTable):
            names = [name for name, kind in vars(base).get("__annotations__", {}).items() if "ClassVar" not in kind]
            found |= {name: TableField(base, name, vars(base).get(name, REQUIRED)) for name in names}
    return found


def errors_of(error: ValueError) -> list[Any]:
    """The errors of a ValidationError of pydantic, which need not be loaded to catch one."""
    found: list[Any] = error.errors(include_url=False)  # type: ignore[attr-defined]
    return found


def dumped(table: Any, options: Mapping[str, Any]) -> dict[str, Any]:
    """Plain data of a table, with some of the options of `BaseModel.model_dump`."""
    inner = {name: option for name, option in options.items() if name not in ("include", "exclude")}
    result = {}
    for name, field in fields_of(type(table)).items():  # type: ignore[arg-type]
        value = getattr(table, name)
        if (
            name in (options.get("exclude") or ())
            or (options.get("include") is not None and name not in options["include"])
            or (options.get("exclude_unset") and name not in table.model_fields_set)
            or (options.get("exclude_defaults") and field.default is not REQUIRED and value == field.default)
            or (options.get("exclude_none") and value is None)
        ):
            continue
        result[field.key if options.get("by_alias") else name] = _plain(value, inner)
    return result


def _plain(value: Any, options: Mapping[str, Any]) -> Any:
    if isinstance(value, TypedTable):
        return dumped(value, options)
    if isinstance(value, list | tuple):
        each = (_plain(one, options) for one in value)
        return tuple(each) if isinstance(value, tuple) and options.get("mode") != "json" else list(each)
    if isinstance(value, dict):
        return {key: _plain(one, options) for key, one in value.items()}
    if options.get("mode") == "json" and not isinstance(value, str | int | float | None):
        return str(value)  # a path or a URL, which has no secret as text
    return value


if TYPE_CHECKING:
    from pydantic import BaseModel
    from pydantic import Field as Field

    class TypedTable(BaseModel):
        """As a type checker sees it."""

        def check(self) -> None:
            """ValueError if the values do not fit together."""
else:
    Field = Specification

    class TypedTable:
        """A frozen object with a value for each key; `model_fields_set` has the names of those that were given."""

        __slots__ = ("__dict__", "__weakref__", "model_fields_set")
        model_config: ClassVar[dict[str, Any]] = {}

        def __init_subclass__(cls, **settings: Any) -> None:
            cls.model_config = cls.model_config | settings

        def __init__(self, **given: Any) -> None:
            made = type(self).model_validate(given)
            self._fill(vars(made), made.model_fields_set)

        def _fill(self, values: Mapping[str, Any], given: Collection[str]) -> None:
            vars(self).update(values)
            object.__setattr__(self, "model_fields_set", {*given})

        @classmethod
        def model_validate(cls, data: Any) -> Any:
            """The table in data; ValidationError of pydantic, which is a ValueError, if it is invalid."""
            try:
                return plain_value(cls, data)
            except NotPlainError:
                from livebode.core.typed_table_model import validated

                return validated(cls, data)

        @classmethod
        def of_plain(cls, data: Any) -> Any:
            """The table in data that is plainly valid; NotPlainError if pydantic has to decide."""
            if type(data) is not dict:
                raise NotPlainError
            by_key = {field.key: field for field in fields_of(cls).values()}
            if not data.keys() <= by_key.keys() and cls.model_config.get("extra") != "allow":
                raise NotPlainError
            values = {by_key[key].name: plain_value(by_key[key].kind, data[key]) for key in data if key in by_key}
            return cls.of_values(values, values.keys())

        @classmethod
        def of_values(cls, values: Mapping[str, Any], given: Collection[str]) -> Any:
            """The table with these values of its types, and defaults for others; NotPlainError if they do not fit."""
            made = object.__new__(cls)
            made._fill(
                {name: values[name] if name in values else key.own_default() for name, key in fields_of(cls).items()},
                given,
            )
            try:
                made.check()
            except ValueError as error:
                raise NotPlainError from error
            return made

        def check(self) -> None:
            """ValueError if the values do not fit together."""

        def model_copy(self, *, update: Mapping[str, Any]) -> Any:
            """The same with other values, which are not checked."""
            made = object.__new__(type(self))
            made._fill(vars(self) | update, self.model_fields_set | update.keys())
            return made

        def model_dump(self, **options: Any) -> dict[str, Any]:
            """Plain data, with the options of pydantic."""
            return dumped(self, options)

        @classmethod
        def model_json_schema(cls, **options: Any) -> dict[str, Any]:
            """JSON Schema, by pydantic."""
            from livebode.core.typed_table_model import model_of

            return model_of(cls).model_json_schema(**options)

        @classmethod
        def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> Any:
            from livebode.core.typed_table_model import core_schema_of

            return core_schema_of(cls, handler)

        def __setattr__(self, name: str, value: object) -> None:
            raise AttributeError(f"{type(self).__name__} is frozen: {name} cannot be set")

        def __setstate__(self, state: Any) -> None:
            self._fill(state[0], state[1]["model_fields_set"])

        def __iter__(self) -> Iterator[tuple[str, Any]]:
            return iter(vars(self).items())

        def __eq__(self, other: object) -> bool:
            return vars(self) == vars(other) if type(other) is type(self) else NotImplemented

        def __hash__(self) -> int:
            return hash((type(self), *vars(self).values()))

        def __repr__(self) -> str:
            return f"{type(self).__name__}({', '.join(f'{name}={value!r}' for name, value in self)})"

    class _Fields:
        """The keys of a class as pydantic describes them."""

        def __get__(self, instance, owner):
            from livebode.core.typed_table_model import model_of

            return model_of(owner).model_fields

    TypedTable.model_fields = _Fields()
