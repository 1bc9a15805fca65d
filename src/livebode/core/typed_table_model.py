"""The models of pydantic that belong to the classes of `TypedTable`."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import cache
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import AfterValidator, BaseModel, Field, PlainValidator, TypeAdapter, WithJsonSchema
from pydantic_core import core_schema

from livebode.core.typed_table import TypedTable, fields_of
from livebode.core.typed_values import REQUIRED, Conversion, NotPlainError, Specification, ValueCheck

# One for all: a model that is built builds those that it contains, and axes and requests of the dashboard are threads.
_building = threading.RLock()


def validated(table: Any, data: Any) -> Any:
    """The table in data; ValidationError if it is invalid."""
    with _building:
        adapter = _adapter(table)
    return adapter.validate_python(data)


@cache
def _adapter(table: Any) -> TypeAdapter[Any]:
    return TypeAdapter(table)


def model_of(table: Any) -> type[BaseModel]:
    """The model of a table."""
    with _building:
        return _built(table)


@cache
def _built(table: Any) -> type[BaseModel]:
    bases = [_built(base) for base in table.__bases__ if issubclass(base, TypedTable) and base is not TypedTable]
    own = vars(table).get("__annotations__", {})
    space: dict[str, Any] = {
        "__module__": table.__module__, "__qualname__": table.__qualname__, "__doc__": table.__doc__,
        "__annotations__": {}, "model_config": dict(table.model_config),
    }  # fmt: skip
    for name, field in fields_of(table).items():
        if name in own:
            space["__annotations__"][name] = _standard(field.kind)
            default: dict[str, Any] = {} if field.default is REQUIRED else {"default": field.default}
            space[name] = Field(alias=None if field.key == name else field.key, **default)
    metaclass: Any = type(BaseModel)
    model: type[BaseModel] = metaclass(table.__name__, tuple(bases) or (BaseModel,), space)
    return model


def _standard(kind: Any) -> Any:
    """The type with what pydantic reads in place of our specifications."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is Annotated:
        found = _standard(arguments[0])
        for each in kind.__metadata__:
            found = annotated(found, each)
        return found
    if origin in (Union, UnionType):
        return Union[tuple(map(_standard, arguments))]  # noqa: UP007 - of a tuple
    if origin in (list, dict, tuple):
        return origin[tuple(map(_standard, arguments))]
    return kind


def annotated(kind: Any, given: Any) -> Any:
    """The type with what pydantic reads in place of one of our specifications."""
    if isinstance(given, Specification):
        return Annotated[kind, Field(**given.limits)]
    if isinstance(given, ValueCheck):
        return Annotated[kind, AfterValidator(given.function)]
    if isinstance(given, Conversion):
        form = WithJsonSchema({"type": "string", "format": given.format})
        return Annotated[kind, PlainValidator(given.function), form]
    return Annotated[kind, given]


def _of_model(table: Any, model: Any) -> Any:
    return table.of_values({name: getattr(model, name) for name in fields_of(table)}, model.model_fields_set)


def core_schema_of(table: Any, handler: Any) -> Any:
    """How a model with a table in it reads and writes that table."""

    def read(data: Any, inner: Callable[[Any], Any]) -> Any:
        if isinstance(data, table):
            return data
        model = inner(data)
        try:
            return _of_model(table, model)
        except NotPlainError as error:
            raise ValueError(str(error.__cause__)) from None

    def write(value: Any, info: Any) -> Any:
        options = ("mode", "by_alias", "exclude_unset", "exclude_defaults", "exclude_none")
        return value.model_dump(**{name: getattr(info, name) for name in options})

    return core_schema.no_info_wrap_validator_function(
        read,
        handler.generate_schema(model_of(table)),
        serialization=core_schema.plain_serializer_function_ser_schema(write, info_arg=True),
    )
