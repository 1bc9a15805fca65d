"""A controller's memory and its programs: parsed, held to the subset, and run."""

from __future__ import annotations

import gc
import pickle
from collections.abc import Callable
from functools import cache, cached_property
from importlib.metadata import version
from types import SimpleNamespace
from typing import Any

import numpy as np
from blark import transform as tf
from blark.parse import parse_source_code

from livebode.structured_text import KEYWORDS
from tools.stored import stored
from tools.structured_text.expressions import RUNTIME, Scope, assignable
from tools.structured_text.statements import Body
from tools.structured_text.types import SCALARS, Array, Kind, Named, RefusedError, Scalar, image, zero

SECTIONS = {
    tf.InputDeclarations: "input",
    tf.OutputDeclarations: "output",
    tf.InputOutputDeclarations: "in_out",
    tf.VariableDeclarations: "own",
}


class ReturnNow(Exception):  # noqa: N818 (no error)
    """RETURN."""


@cache
def parse(text: str) -> tuple:
    """blark's declarations in `text`; what it cannot parse fails."""
    file = stored(f"blark {version('blark')}\0{text}", lambda path: path.write_bytes(pickle.dumps(_parsed(text))))
    return pickle.loads(file.read_bytes())


def _parsed(text: str) -> tuple:
    gc.disable()  # it makes a million objects and no circles, and each pass of the collector visits them all
    try:
        result = parse_source_code(text)
    finally:
        gc.enable()
    if result.exception is not None:
        raise result.exception
    return tuple(result.transform().items)


class Unit:
    """A structure, function block or program: its variables, and where they are declared."""

    def __init__(self, node: Any) -> None:
        structure = isinstance(node, tf.DataTypeDeclaration)
        node = node.declaration if structure else node
        if not isinstance(node, tf.StructureTypeDeclaration | tf.FunctionBlock | tf.Program):
            raise RefusedError(f"{type(node).__name__} is not in the subset")
        self.name, self.body = str(node.name).lower(), None if structure else node.body
        self.kinds: dict[str, Kind] = {}
        self.places: dict[str, str] = {}
        self.initial: dict[str, object] = {}
        if structure:
            self._declare(node.declarations, "output")
        for section in () if structure else node.declarations:
            if type(section) not in SECTIONS or getattr(section, "attrs", None):
                raise RefusedError(f"{type(section).__name__} is not in the subset")
            self._declare(section.items, SECTIONS[type(section)])

    def _declare(self, items: Any, place: str) -> None:
        for item in items:
            for declared in item.variables:
                name = str(getattr(declared, "variable", declared).name).lower()
                if name in self.kinds or name in KEYWORDS:
                    raise RefusedError(f"{name} is declared twice, or a keyword")
                self.kinds[name], self.initial[name] = _kind(item.init)
                self.places[name] = place

    @cached_property
    def inputs(self) -> dict[str, tuple[Kind, bool]]:
        """Type of each, and whether every call must give it."""
        return {n: (self.kinds[n], p == "in_out") for n, p in self.places.items() if p in ("input", "in_out")}

    @property
    def readable(self) -> dict[str, Kind]:
        return {n: k for n, k in self.kinds.items() if self.places[n] == "output"}


class Machine:
    """Declarations from texts, made to run; `functions` are those of the controller, by their upper-case names."""

    def __init__(self, *texts: str, functions: dict[str, tuple[Scalar, Callable[[], object]]] | None = None) -> None:
        found = [Unit(node) for text in texts for node in parse(text)]
        self.units = {unit.name: unit for unit in found}
        if len(self.units) != len(found):
            raise RefusedError("a name is declared twice")
        functions = functions or {}
        calls = {f"f_{name}": lambda k=kind, f=call: k.checked(f()) for name, (kind, call) in functions.items()}
        self._globals = {**RUNTIME, **calls, "ReturnNow": ReturnNow}
        kinds = {name: kind for name, (kind, _) in functions.items()}
        self._runs = {unit.name: self._compiled(unit, kinds) for unit in found if unit.body is not None}

    def _compiled(self, unit: Unit, functions: dict[str, Kind]) -> Callable:
        for kind in unit.kinds.values():
            if isinstance(kind, Named) and kind.name not in self.units:
                raise RefusedError(f"{unit.name} uses {kind.name}, which is not declared")
        scope = Scope(unit.kinds, {u.name: u.readable for u in self.units.values()}, functions)
        body = Body(scope, {u.name: u.inputs for u in self.units.values() if u.body is not None})
        body.block(unit.body)
        scalars = [n for n, k in unit.kinds.items() if isinstance(k, Scalar)]
        text = ["def run(self):", "    operations = 0"]
        text += [f"    v_{name} = self.v_{name}" for name in unit.kinds]
        text += ["    try:", *body.lines, "    except ReturnNow:", "        pass"]
        text += [f"    self.v_{name} = v_{name}" for name in scalars]
        text += ["    return operations"]
        space = dict(self._globals)
        exec("\n".join(text), space)
        return space["run"]

    def instance(self, name: str) -> Instance:
        """A function block, program or structure with its initial values."""
        return Instance(self.units[name.lower()], self.memory(name.lower()))

    def memory(self, name: str) -> SimpleNamespace:
        unit, memory = self.units[name], SimpleNamespace()
        for variable, kind in unit.kinds.items():
            if isinstance(kind, Named):
                handed = unit.places[variable] == "in_out"
                value = None if handed else self.memory(kind.name)
            else:
                given = unit.initial[variable]
                value = zero(kind) if given is None else given
            setattr(memory, f"v_{variable}", value)
        if name in self._runs:
            memory.run = self._runs[name].__get__(memory)
        return memory


class Instance:
    """One block in memory, to be looked at and called from a test."""

    def __init__(self, unit: Unit, memory: SimpleNamespace) -> None:
        self._unit, self.memory = unit, memory

    def __call__(self, **given: object) -> int:
        """One cycle with these inputs; how many LREAL operations it took."""
        for name, value in given.items():
            kind, _ = self._unit.inputs[name.lower()]
            self.memory.__dict__[f"v_{name.lower()}"] = value if isinstance(kind, Named) else kind.checked(value)
        return self.memory.run()

    def __getitem__(self, name: str) -> Any:
        kind, value = self._unit.kinds[name.lower()], getattr(self.memory, f"v_{name.lower()}")
        return np.array(value).reshape(kind.lengths) if isinstance(kind, Array) else value

    def __setitem__(self, name: str, value: object) -> None:
        setattr(self.memory, f"v_{name.lower()}", self._unit.kinds[name.lower()].checked(value))

    def bytes(self) -> bytes:
        """The structure as it lies in the controller's memory."""
        values = {n: (k, getattr(self.memory, f"v_{n}")) for n, k in self._unit.kinds.items()}
        return image(values)


def _kind(init: Any) -> tuple[Kind, object]:
    """Type and initial value of a declaration."""
    if isinstance(init, tf.ArrayTypeInitialization):
        if init.value is not None or init.indirection is not None:
            raise RefusedError("an array with initial values, or of pointers")
        ranges = [(int(str(r.start.value)), int(str(r.stop.value))) for r in init.spec.subranges]
        of = SCALARS.get(str(init.spec.type.type_name))
        if of is None or any(start != 0 or stop < 0 for start, stop in ranges):
            raise RefusedError("an array that does not count from 0, or not of numbers")
        return Array(tuple(stop + 1 for _, stop in ranges), of), None
    if not isinstance(init, tf.TypeInitialization) or type(init.spec) is not tf.SimpleSpecification:
        raise RefusedError(f"{type(init).__name__} is not in the subset")
    name = str(init.spec.type)
    if name.upper() not in SCALARS:
        return Named(name.lower()), None
    kind = SCALARS[name.upper()]
    if init.value is None:
        return kind, None
    value = Scope({}, {}, {}).expression(init.value)
    assignable(value, kind)
    return kind, kind.checked(eval(value.text))
