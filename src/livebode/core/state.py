"""States of stages as bytes, from which they continue exactly: one encoding, with versions and checksums.

A state is 20 bytes of head (magic, version of the encoding, version of the stage's state, length of the description,
CRC-32 of description and arrays, CRC-32 of the head), a description in JSON, the arrays, and the states of its parts,
each complete in itself. docs/reference/formats.md specifies it.
"""

from __future__ import annotations

import hashlib
import json
import math
import struct
import sys
import zlib
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, ClassVar, NamedTuple, NoReturn, Protocol

import numpy as np

from livebode.core.errors import StateError
from livebode.version import __version__

ENCODING = 1
"""Version of the encoding itself."""

DTYPES = ("<f8", "<f4", "<c16", "<c8", "<i8", "<i4", "|b1", "|u1")
"""Types that an array of a state may have, little-endian, as NumPy names them."""

_PLAIN = {np.dtype(name) for name in DTYPES} if sys.byteorder == "little" else set[np.dtype[Any]]()
_MAGIC = b"LBST"
_HEAD, _CHECK = struct.Struct("<4sHHII"), struct.Struct("<I")
_SIZE = _HEAD.size + _CHECK.size
# What restoring invalid values raises.
_INVALID = ArithmeticError, AssertionError, AttributeError, LookupError, TypeError, ValueError


class Stage(NamedTuple):
    """Name of a stage in its states, and the version of their content. Neither depends on the name of a class."""

    name: str
    version: int


class Stateful(Protocol):
    """Something that continues from a state."""

    def snapshot(self) -> bytes:
        """Everything that the next result depends on, exact; the same bytes for the same state."""
        ...

    def restore(self, snapshot: bytes) -> None:
        """Continue from a snapshot; unchanged where that cannot be restored."""
        ...


class StatefulBase:
    """Base of the stages with a state.

    A subclass names its `_stage`, and in `_STATE` the attributes with its state: arrays, plain data and other stages,
    each with the type and the shape that it has in a new instance. Others it adds in `_state` and `_load`.
    """

    _stage: ClassVar[Stage]
    _STATE: ClassVar[tuple[str, ...]] = ()

    def snapshot(self) -> bytes:
        """Everything that the next result depends on, exact; see `restore`."""
        return encode(self._stage, self._state(), self._identity)

    def restore(self, snapshot: bytes) -> None:
        """Continue from a snapshot of a stage with the same settings.

        Raises
        ------
        StateError
            If the snapshot is damaged, or from another stage, other settings or another version; nothing has changed
            then.
        """
        state, before = decode(self._stage, snapshot, self._identity), self.snapshot()
        try:
            self._load(state)
        except _INVALID as error:
            self._load(decode(self._stage, before, self._identity))
            if isinstance(error, StateError):
                raise
            _damaged(self._stage, f"invalid value ({error})")

    @property
    def _identity(self) -> str:
        """Settings that the meaning of the state depends on."""
        return ""

    def _state(self) -> dict[str, Any]:
        return {name.lstrip("_"): getattr(self, name) for name in self._STATE}

    def _load(self, state: dict[str, Any]) -> None:
        for name in self._STATE:
            setattr(self, name, _like(getattr(self, name), state[name.lstrip("_")], name))


def encode(stage: Stage, values: Mapping[str, Any], identity: str = "") -> bytes:
    """The state of a stage: arrays, stages (or their snapshots) and plain data, by name.

    Parameters
    ----------
    stage
        Name and version.
    values
        NumPy arrays, stages, bytes, and plain data for JSON. NaN and infinity are permitted.
    identity
        Settings that the meaning of the values depends on; stored as a fingerprint.

    Examples
    --------
    >>> stage = Stage("mean", 1)
    >>> data = encode(stage, {"count": 2, "mean": np.array([0.5, np.nan])})
    >>> decode(stage, data)
    {'count': 2, 'mean': array([0.5, nan])}
    """
    plain: dict[str, Any] = {}
    form: list[tuple[str, np.dtype[Any], tuple[int, ...]]] = []
    lengths: list[tuple[str, int]] = []
    arrays: list[memoryview] = []
    parts: list[bytes] = []
    for name, value in values.items():
        if isinstance(value, np.ndarray):
            array = _little_endian(value)
            form.append((name, array.dtype, array.shape))
            if array.size:
                arrays.append(array.data)
        elif isinstance(value, StatefulBase | bytes):
            part = value if isinstance(value, bytes) else value.snapshot()
            lengths.append((name, len(part)))
            parts.append(part)
        else:
            plain[name] = value
    content = f"{_to_json(plain) if plain else '{}'}{_arrays(tuple(form))}{_parts(tuple(lengths))}"
    text = f"{_begin(stage.name, identity)}{content}".encode()
    check = zlib.crc32(text)
    for data in arrays:
        check = zlib.crc32(data, check)
    head = _HEAD.pack(_MAGIC, ENCODING, stage.version, len(text), check)
    return b"".join([head, _CHECK.pack(zlib.crc32(head)), text, *arrays, *parts])


def decode(stage: Stage, data: bytes, identity: str = "") -> dict[str, Any]:
    """The values of a state, with the states of its parts as bytes; these are not checked yet.

    Raises
    ------
    StateError
        If the bytes are damaged, or not a state of this stage and these settings in its version.
    """
    version, text, offset, check = _head(stage, data)
    try:
        header = json.loads(text)
        values: dict[str, Any] = dict(header["plain"])
        for name, (dtype, shape) in header["arrays"].items():
            values[name] = _array(data, offset, dtype, shape)
            offset += values[name].nbytes
        if zlib.crc32(memoryview(data)[_SIZE:offset]) != check:
            raise ValueError("wrong checksum")
        for name, length in header["parts"].items():
            values[name], offset = bytes(data[offset : offset + length]), offset + length
        if offset != len(data):
            raise ValueError(f"{len(data)} bytes instead of {offset}")
        name, settings, writer = header["stage"], header["settings"], str(header.get("livebode", ""))
    except (*_INVALID, RecursionError) as error:
        _damaged(stage, str(error))
    if name != stage.name:
        raise StateError(
            "other-stage",
            f"the state belongs to {name!r}, not to {stage.name!r}",
            "restore it into that",
            name=stage.name,
            found=name,
        )
    _check_version(stage, version, writer)
    if settings != _fingerprint(identity):
        raise StateError(
            "other-settings",
            f"the state belongs to {name!r} with other settings",
            "restore it into one with the same settings",
            name=name,
        )
    return values


def restore_parts(parts: Mapping[str, Stateful], states: Mapping[str, bytes]) -> None:
    """Continue all of them from the states of the same names; StateError, and none has changed, if one cannot."""
    before: dict[str, bytes] = {}
    try:
        for name, part in parts.items():
            before[name] = part.snapshot()
            part.restore(states[name])
    except Exception:
        for name, state in before.items():
            parts[name].restore(state)
        raise


def _head(stage: Stage, data: bytes) -> tuple[int, bytes, int, int]:
    """Version of the state, its description, where that ends, and the checksum."""
    if data[: len(_MAGIC)] != _MAGIC:
        raise StateError(
            "not-a-state",
            f"these {len(data)} bytes are not a state of {stage.name!r}",
            "start without it",
            name=stage.name,
            size_bytes=len(data),
        )
    if len(data) < _SIZE or _CHECK.unpack_from(data, _HEAD.size)[0] != zlib.crc32(data[: _HEAD.size]):
        _damaged(stage, "wrong checksum of its head")
    _, encoding, version, length, check = _HEAD.unpack_from(data)
    if encoding > ENCODING:
        _newer(stage, encoding, ENCODING, _writer(data))
    return version, data[_SIZE : _SIZE + length], _SIZE + length, check


def _check_version(stage: Stage, version: int, writer: str) -> None:
    if version > stage.version:
        _newer(stage, version, stage.version, writer)
    if version < stage.version:
        raise StateError(
            "older-version",
            f"{_written(stage, version, writer)}, which reads version {stage.version}",
            _remedy(writer),
            name=stage.name,
            found=version,
            readable=stage.version,
            written_by=writer,
        )


def _newer(stage: Stage, version: int, readable: int, writer: str) -> NoReturn:
    raise StateError(
        "newer-version",
        f"{_written(stage, version, writer)}, which reads up to version {readable}",
        _remedy(writer),
        name=stage.name,
        found=version,
        readable=readable,
        written_by=writer,
    )


def _written(stage: Stage, version: int, writer: str) -> str:
    by = f"livebode {writer}" if writer else "another livebode"
    return f"the state of {stage.name!r} has version {version}, written by {by}; this is livebode {__version__}"


def _remedy(writer: str) -> str:
    return f"finish the run with {f'livebode {writer}' if writer else 'the version that began it'}, or start a new run"


def _writer(data: bytes) -> str:
    """The livebode that wrote a state in another encoding, if its description says that as this encoding does."""
    length = _HEAD.unpack_from(data)[3]
    try:
        return str(json.loads(data[_SIZE : _SIZE + length])["livebode"])
    except (*_INVALID, RecursionError):
        return ""


def _damaged(stage: Stage, reason: str) -> NoReturn:
    raise StateError(
        "damaged",
        f"the state of {stage.name!r} is damaged: {reason}",
        "start without it",
        name=stage.name,
        reason=reason,
    ) from None


def _like(now: Any, value: Any, name: str) -> Any:
    """The value for an attribute with the value `now`; ValueError if it has another type or shape."""
    if isinstance(now, StatefulBase):
        now.restore(value)
        return now
    if isinstance(now, np.ndarray):
        if value.shape != now.shape or value.dtype.kind != now.dtype.kind:
            raise ValueError(f"{name} has shape {value.shape} instead of {now.shape}")
        return value.astype(now.dtype, copy=False)
    if type(value) is not type(_item(now) if isinstance(now, np.generic) else now):
        raise ValueError(f"{name} is {value!r}")
    return value


def _array(data: bytes, offset: int, dtype: str, shape: list[int]) -> np.ndarray:
    if dtype not in DTYPES or not all(type(n) is int and n >= 0 for n in shape):
        raise ValueError(f"array of type {dtype!r} and shape {shape!r}")
    array = np.frombuffer(data, dtype=dtype, count=math.prod(shape), offset=offset).reshape(shape)
    return array.astype(array.dtype.newbyteorder("="))


def _little_endian(array: np.ndarray) -> np.ndarray:
    if array.dtype in _PLAIN and array.flags.c_contiguous:
        return array
    if sys.byteorder == "big" or array.dtype.byteorder == ">":
        array = array.astype(array.dtype.newbyteorder("<"))
    if array.dtype.str not in DTYPES:
        raise TypeError(f"an array of type {array.dtype} cannot be in a state")
    return np.asarray(array, order="C")


def _item(value: Any) -> Any:
    """A scalar of NumPy as plain data."""
    if not isinstance(value, np.generic):
        raise TypeError(f"{value!r} cannot be in a state")
    return value.item()


_to_json = json.JSONEncoder(separators=(",", ":"), default=_item).encode


# A live axis describes the same stages twice a second; only their plain data differs.
@lru_cache(maxsize=256)
def _begin(name: str, identity: str) -> str:
    """A description up to the plain data."""
    about = {"stage": name, "settings": _fingerprint(identity), "livebode": __version__}
    return f'{_to_json(about)[:-1]},"plain":'


@lru_cache(maxsize=256)
def _arrays(form: tuple[tuple[str, np.dtype[Any], tuple[int, ...]], ...]) -> str:
    return f',"arrays":{_to_json({name: (dtype.str, shape) for name, dtype, shape in form})}'


@lru_cache(maxsize=1024)
def _parts(lengths: tuple[tuple[str, int], ...]) -> str:
    return f',"parts":{_to_json(dict(lengths))}}}'


def _fingerprint(identity: str) -> str:
    return hashlib.sha256(identity.encode()).hexdigest()[:32] if identity else ""
