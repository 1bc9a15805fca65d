"""The contract of everything with a state: what every class with `snapshot` and `restore` must do."""

from __future__ import annotations

import importlib
import inspect
import json
import pkgutil
import struct
import sys
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np
import pytest

from livebode.core import Stage, StateError, Stateful, StatefulBase, decode, encode

HEAD_BYTES = 20
FLIPS = 24


@dataclass(frozen=True)
class Case:
    """A class with a state, small and as a run uses it.

    Parameters
    ----------
    make
        A new instance.
    steps
        Inputs that change its state, one after another; each returns what is compared.
    others
        The same class with other settings.
    volatile
        Values of its state that depend on the clock of this computer.
    continuing
        What continues from a snapshot, not restored yet; a new instance by default.
    """

    make: Callable[[], Any]
    steps: Sequence[Callable[[Any], object]]
    others: Sequence[Callable[[], Any]] = ()
    volatile: frozenset[str] = frozenset()
    continuing: Callable[[bytes], Any] | None = None

    def after(self, steps: int) -> Any:
        """An instance after so many steps."""
        stage = self.make()
        for step in self.steps[:steps]:
            step(stage)
        return stage

    def ready(self, snapshot: bytes) -> Any:
        return self.make() if self.continuing is None else self.continuing(snapshot)

    def plain(self, stage: Stateful) -> object:
        """Its snapshot, to compare."""
        snapshot = stage.snapshot()
        return snapshot if not self.volatile else _without(snapshot, self.volatile)


def check_stateful(case: Case) -> set[type]:
    """The whole contract, for an instance and each stage inside it; returns their classes."""
    used = case.after(len(case.steps))
    inside = [(place, stage, stage.snapshot()) for place, stage in stages_in(used)]
    check_refuses(case, used.snapshot())
    new = dict(stages_in(case.make()))
    for place, stage, snapshot in inside:
        if place and type(new.get(place)) is type(stage):
            check_part(new[place], snapshot)
    check_continues(case, used)
    return {type(stage) for _, stage, _ in inside}


def check_continues(case: Case, used: Any) -> None:
    """A restored one gives the same results and the same snapshots as one that continued, new or used before."""
    begun, whole = case.make(), case.after(len(case.steps) - 1)
    snapshot, before = whole.snapshot(), case.plain(whole)
    assert case.plain(whole) == before, "a snapshot changes the state"
    assert len({str(case.plain(stage)) for stage in (begun, whole, used)}) == 3, "the input does not change the state"
    if case.continuing is None:
        used.restore(begun.snapshot())
        assert case.plain(used) == case.plain(begun)
    restored = [case.ready(snapshot), *([] if case.continuing else [used])]
    for other in restored:
        other.restore(snapshot)
        assert case.plain(other) == before
    expected = bits(case.steps[-1](whole))
    assert all(bits(case.steps[-1](other)) == expected for other in restored)
    assert all(case.plain(other) == case.plain(whole) for other in restored)


def check_refuses(case: Case, snapshot: bytes) -> None:
    """Damaged, foreign and newer states are refused, and nothing changes."""
    stage = case.after(1)
    before = case.plain(stage)
    for wrong, code in wrong_ones(snapshot):
        with pytest.raises(StateError) as caught:
            stage.restore(wrong)
        assert caught.value.code in code, f"{caught.value.code}: {caught.value}"
        assert "\n" not in str(caught.value)
        assert case.plain(stage) == before, f"{caught.value.code} left a changed state"
    for other in case.others:
        with pytest.raises(StateError) as caught:
            stage.restore(other().snapshot())
        assert caught.value.code == "state.other-settings"
        assert case.plain(stage) == before


def check_part(new: Stateful, snapshot: bytes) -> None:
    """A stage inside another one: restored it has the same state, and it refuses what is not one."""
    before = new.snapshot()
    twin = isinstance(new, StatefulBase)
    for wrong, code in wrong_ones(snapshot) if twin else ((snapshot[:-1], ""), (flipped(snapshot, 99), "")):
        with pytest.raises(StateError if twin else ValueError) as caught:  # the kernel has no errors of the package
            new.restore(wrong)
        assert not twin or caught.value.code in code, str(caught.value)  # type: ignore[attr-defined]
        assert new.snapshot() == before
    new.restore(snapshot)
    assert new.snapshot() == snapshot
    new.restore(before)
    assert new.snapshot() == before


def wrong_ones(snapshot: bytes) -> Iterator[tuple[bytes, tuple[str, ...]]]:
    """What is no state of this stage, and the codes that tell so."""
    damaged = ("state.damaged",)
    for size in (0, 3):
        yield snapshot[:size], ("state.not-a-state",)
    for size in (4, HEAD_BYTES - 1, HEAD_BYTES, len(snapshot) // 2, len(snapshot) - 1):
        yield snapshot[:size], damaged
    yield snapshot + b"\0", damaged
    for bit in np.linspace(0, 8 * len(snapshot) - 1, FLIPS).astype(int).tolist():
        yield flipped(snapshot, bit), ("state.not-a-state", *damaged)  # a magic, of it or of a stage inside
    yield encode(Stage("another", 1), {}), ("state.other-stage",)
    newer = ("state.newer-version",)
    yield renewed(snapshot, encodings=1), newer
    yield renewed(snapshot, versions=1), newer
    (version,) = struct.unpack_from("<H", snapshot, 6)
    yield renewed(snapshot, versions=-version), ("state.older-version",)
    yield from ((inside, newer) for inside in newer_inside(snapshot))


def flipped(snapshot: bytes, bit: int) -> bytes:
    """With one bit flipped."""
    data = bytearray(snapshot)
    data[bit // 8] ^= 1 << bit % 8
    return bytes(data)


def renewed(snapshot: bytes, *, encodings: int = 0, versions: int = 0) -> bytes:
    """As a livebode newer by so many versions would write it."""
    magic, encoding, version, length, check = struct.unpack_from("<4sHHII", snapshot)
    head = struct.pack("<4sHHII", magic, encoding + encodings, version + versions, length, check)
    return head + struct.pack("<I", zlib.crc32(head)) + snapshot[HEAD_BYTES:]


def newer_inside(snapshot: bytes) -> Iterator[bytes]:
    """With the last stage inside in a newer version: the stages before it are restored already."""
    parts = described(snapshot)["parts"]
    if parts:
        length = list(parts.values())[-1]
        part = snapshot[len(snapshot) - length :]
        if part[:4] == snapshot[:4]:
            yield snapshot[: len(snapshot) - length] + renewed(part, versions=1)


def described(snapshot: bytes) -> dict[str, Any]:
    """The description of a state."""
    (length,) = struct.unpack_from("<I", snapshot, 8)
    return dict(json.loads(snapshot[HEAD_BYTES : HEAD_BYTES + length]))


def _without(snapshot: bytes, names: frozenset[str]) -> object:
    def fixed(value: Any) -> Any:
        return {name: fixed(v) for name, v in value.items() if name not in names} if isinstance(value, dict) else value

    return bits(fixed(decode(Stage(described(snapshot)["stage"], 1), snapshot)))


def bits(value: Any) -> object:
    """Comparable content: arrays by their bits, so that NaN equals NaN."""
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tolist() if value.dtype.kind in "OU" else value.tobytes()
    if is_dataclass(value) and not isinstance(value, type):
        return type(value).__name__, [bits(getattr(value, one.name)) for one in fields(value)]
    if isinstance(value, dict):
        return [(key, bits(one)) for key, one in value.items()]
    if isinstance(value, (list, tuple)):
        return [bits(one) for one in value]
    return repr(value)


def stages_in(root: object, place: tuple[object, ...] = ()) -> Iterator[tuple[tuple[object, ...], Any]]:
    """Everything with a state inside this one, itself included, with the way to it."""
    seen: set[int] = set()

    def within(value: object, at: tuple[object, ...]) -> Iterator[tuple[tuple[object, ...], Any]]:
        if isinstance(value, dict):
            for key, one in value.items():
                yield from within(one, (*at, key))
        elif type(value).__module__.startswith("livebode") and id(value) not in seen:
            seen.add(id(value))
            if hasattr(value, "snapshot") and hasattr(value, "restore"):
                yield at, value
            yield from within(getattr(value, "__dict__", {}), at)

    yield from within(root, place)


def every_class() -> set[type]:
    """Every class of package and wings with `snapshot` and `restore` that has a stage or no derived class."""
    roots = [one.name for one in pkgutil.iter_modules() if one.name.startswith("livebode")]
    paths = {f"{root}.": importlib.import_module(root).__path__ for root in roots}
    names = [one.name for prefix, path in paths.items() for one in pkgutil.walk_packages(path, prefix)]
    for name in names:
        importlib.import_module(name)
    found = {
        one
        for name in names
        for one in vars(sys.modules[name]).values()
        if inspect.isclass(one) and one.__module__.startswith("livebode") and not getattr(one, "_is_protocol", False)
        if hasattr(one, "snapshot") and hasattr(one, "restore")
    }
    bases = {one for one in found if any(other is not one and issubclass(other, one) for other in found)}
    return {one for one in found if one not in bases or "_stage" in vars(one)}
