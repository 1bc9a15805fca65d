"""A Baseline as one JSON file: numbers and nested lists, readable by any tool."""

from __future__ import annotations

import hashlib
import json
import re
import zlib
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import BaselineError, Lines, LivebodeError, write_whole, writing
from livebode.monitoring.amplitude import InputAmplitude
from livebode.monitoring.baseline_part import (
    BaselinePart,
    BaselineVersion,
    accuracy_of,
    accuracy_plain,
    as_list,
    table_of,
    table_plain,
)
from livebode.monitoring.between_runs import BetweenRuns
from livebode.monitoring.covariates import Covariates
from livebode.monitoring.learned_torque import LearnedTorque
from livebode.monitoring.machine import LearnedMachine
from livebode.monitoring.ripple import Ripple
from livebode.monitoring.sensitivity import DIRECTIONS
from livebode.monitoring.torque_model import TorqueModel, TorqueNoise
from livebode.motion import MovingModel, PositionCurve, Shaft
from livebode.version import __version__

_ARRAYS = "speed", "friction", "lines_hz"
_NOISE = "frequency_hz", "power"
_NUMBERS = "inertia", "offset", "turn"


def torque_plain(learned: LearnedTorque) -> dict[str, Any]:
    """Friction and orders as plain data, for JSON."""
    model = learned.model
    return {
        "kind": model.kind,
        **{name: getattr(model, name) for name in _NUMBERS},
        **{name: as_list(getattr(model, name)) for name in _ARRAYS},
        "shafts": [{"name": shaft.name, "turns": shaft.turns, "orders": list(shaft.orders)} for shaft in model.shafts],
        "middle": learned.middle,
        "noise": None if learned.noise is None else {n: as_list(getattr(learned.noise, n)) for n in _NOISE},
        "true": as_list(learned.true),
        "usual": as_list(learned.usual),
        "tables": [table_plain(table) for table in learned.tables],
    }


def torque_of(data: BaselinePart) -> LearnedTorque:
    """From plain data; BaselineError where it is damaged."""
    kind = data.text("kind")
    if kind not in ("position", "velocity"):
        raise data.wrong("kind", "neither position nor velocity")
    arrays = {name: data.array(name, 1) for name in _ARRAYS}
    if arrays["speed"].size != arrays["friction"].size or arrays["speed"].size < 2:
        raise data.wrong("friction", "not as long as speed, or shorter than 2")
    shafts = tuple(_shaft(part) for part in data.parts("shafts"))
    tables = [table_of(part) for part in data.parts("tables")]
    orders = tables[1] if len(tables) > 1 else None
    each = {name: data.array(name, 1, least=0, known=False) for name in ("true", "usual")}
    count = sum(len(shaft.orders) for shaft in shafts) if orders is not None else 0
    for name, values in each.items():
        if values.size != count:
            raise data.wrong(name, f"not {count} numbers")
    return LearnedTorque(
        TorqueModel(
            "position" if kind == "position" else "velocity",
            inertia=data.number("inertia"),
            offset=data.number("offset"),
            turn=data.number("turn"),
            shafts=shafts,
            speed=arrays["speed"],
            friction=arrays["friction"],
            lines_hz=arrays["lines_hz"],
        ),
        data.number("middle"),
        None if orders is None else _noise(data.part("noise")),
        each["true"],
        np.where(np.isnan(each["usual"]), np.inf, each["usual"]),
        tables[0],
        orders,
    )


def _noise(data: BaselinePart) -> TorqueNoise:
    frequency_hz, power = (data.array(name, 1, least=0) for name in _NOISE)
    if frequency_hz.size != power.size or not power.size or not power.all():
        raise data.wrong("power", "not a positive number for each frequency")
    return TorqueNoise(frequency_hz, power)


def _shaft(data: BaselinePart) -> Shaft:
    orders = tuple(int(order) for order in data.array("orders", 1, least=1))
    try:
        return Shaft(data.text("name"), data.number("turns", 0), orders)
    except LivebodeError as error:
        raise data.wrong("orders", f"not those of a shaft ({error.message})") from None


ROLES = ("output", "input", "excitation", "schedule")

_FORMAT = "livebode baseline"
_VERSION = 5
_ID_DIGITS = 16
_CHECKSUM = re.compile(r',\n "crc32": "[0-9a-f]{8}"\n\}\n?\Z')
_LEARN = "learn one from runs (livebode learn)"
_COVARIATE_ARRAYS = {"mean": 1, "low": 1, "high": 1, "slope": 2, "covariance": 3}  # and their dimensions


def id_of(baseline: Mapping[str, Any]) -> str:
    """The id of what was learned, from the fields of a Baseline; paths, dates and reasons do not change it."""
    # A whole number is the same one as int and as float.
    content = json.loads(json.dumps(_learned_plain(baseline), allow_nan=False), parse_int=float)
    text = json.dumps(content, ensure_ascii=False, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:_ID_DIGITS]


def save(baseline: Mapping[str, Any], path: Path) -> None:
    """Write the fields of a Baseline, whole or not at all."""
    text = json.dumps(_plain(baseline), ensure_ascii=False, allow_nan=False, indent=1)
    text = f'{text[:-2]},\n "crc32": "{_checksum(text)}"\n}}\n'
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, text.encode())


def retain(path: Path, copy: Path) -> None:
    """Copy a baseline as it is, whole or not at all."""
    with writing(copy):
        copy.parent.mkdir(parents=True, exist_ok=True)
        write_whole(copy, path.read_bytes())


def load(path: Path) -> dict[str, Any]:
    """The fields of a Baseline in a file that `save` wrote."""
    try:
        text = path.read_text(encoding="utf-8")
        data = json.loads(text)
    except FileNotFoundError:
        raise BaselineError("absent", f"there is no baseline {str(path)!r}", _LEARN, path=str(path)) from None
    except OSError as error:
        raise BaselineError(
            "unreadable",
            f"{str(path)!r} cannot be read: {error.strerror}",
            "check its permissions",
            path=str(path),
            reason=error.strerror,
            errno=error.errno,
        ) from None
    except (ValueError, RecursionError) as error:
        raise BaselineError(
            "not-a-baseline", f"{str(path)!r} is not a baseline: {error}", _LEARN, path=str(path), reason=str(error)
        ) from None
    if not isinstance(data, dict) or data.get("format") != _FORMAT:
        raise BaselineError("not-a-baseline", f"{str(path)!r} is not a baseline", _LEARN, path=str(path))
    version = data.get("version")
    if type(version) is int and version > _VERSION:
        raise BaselineError(
            "newer-version",
            f"{str(path)!r} has version {version} of its format, and this livebode reads version {_VERSION}",
            "update livebode",
            path=str(path),
            found=version,
            readable=_VERSION,
        )
    if version != _VERSION:
        raise BaselineError(
            "version",
            f"{str(path)!r} is a baseline of version {version}, and this livebode reads version {_VERSION}",
            "learn it again",
            path=str(path),
            version=version,
        )
    part = BaselinePart(str(path), "", data)
    _check(part, text)
    return _fields(part)


def _check(data: BaselinePart, text: str) -> None:
    """BaselineError if the checksum, the last key, is not that of the text without it."""
    end = _CHECKSUM.search(text)
    given = data.text("crc32")
    if end is None or given != _checksum(text[: end.start()] + "\n}"):
        raise data.wrong("crc32", "not the checksum of the file: it was changed after it was learned")


def _checksum(text: str) -> str:
    return f"{zlib.crc32(text.encode()):08x}"


def _plain(baseline: Mapping[str, Any]) -> dict[str, Any]:
    history = baseline["history"]
    return {
        "format": _FORMAT,
        "version": _VERSION,
        "livebode": __version__,
        "id": id_of(baseline),
        "learned": baseline["learned"],
        "reason": baseline["reason"],
        "runs": list(baseline["runs"]),
        "replaces": history[0].id if history else None,
        "history": [asdict(version) for version in history],
        "remark": baseline["remark"],
        "torque_remark": baseline["torque_remark"],
        **_learned_plain(baseline),
    }


def _learned_plain(baseline: Mapping[str, Any]) -> dict[str, Any]:
    lines = baseline["lines"]
    return {
        "lines": {"bins": lines.bins, "quiet": lines.quiet, "window": lines.window, "rate_hz": lines.rate_hz},
        "hop": baseline["hop"],
        "signals": baseline["signals"],
        "estimator": baseline["estimator"],
        "quantity": baseline["quantity"],
        "corrected": baseline["corrected"],
        "machine": _machine_plain(baseline["machine"]) if baseline["machine"] else None,
        "tables": [table_plain(table) for table in baseline["tables"]],
    } | ({} if baseline["torque"] is None else {"torque": torque_plain(baseline["torque"])})


def _fields(data: BaselinePart) -> dict[str, Any]:
    part = data.part("lines")
    bins, quiet = (tuple(int(b) for b in part.array(name, 1, least=0)) for name in ("bins", "quiet"))
    window, rate_hz = part.whole("window"), part.number("rate_hz", 0)
    try:
        lines = Lines(bins, window, rate_hz, quiet)
    except LivebodeError as error:
        raise BaselineError(
            "damaged",
            f"the baseline {data.file!r} is damaged: its lines cannot be a grid ({error.message})",
            "learn it again",
            path=data.file,
            key="lines",
            reason=error.message,
        ) from None
    tables = tuple(table_of(table) for table in data.parts("tables"))
    if not tables:
        raise data.wrong("tables", "empty")
    signals = data.part("signals")
    hop = data.whole("hop")
    if hop < 1:
        raise data.wrong("hop", "below 1")
    return {
        "lines": lines,
        "hop": hop,
        "signals": {role: signals.value(role) and signals.text(role) for role in ROLES},
        "estimator": data.text("estimator"),
        "quantity": data.text("quantity"),
        "tables": tables,
        "machine": None if data.value("machine") is None else _machine(data.part("machine"), lines),
        # A baseline that was learned from runs without strokes has none.
        "torque": torque_of(data.part("torque")) if data.has("torque") else None,
        "corrected": data.truth("corrected"),
        "runs": data.texts("runs"),
        "remark": data.text("remark"),
        "torque_remark": data.text("torque_remark"),
        "learned": data.text("learned"),
        "reason": data.text("reason"),
        "history": tuple(map(_version, data.parts("history"))),
    }


def _version(data: BaselinePart) -> BaselineVersion:
    return BaselineVersion(data.text("id"), data.text("learned"), data.texts("runs"), data.text("reason"))


def _machine_plain(machine: LearnedMachine) -> dict[str, Any]:
    model = machine.model
    return {
        "inertia_kg_m2": model.inertia_kg_m2,
        "load_kg": model.load_kg,
        "radius_m": model.radius_m,
        "low_m": model.low_m,
        "high_m": model.high_m,
        "log_stiffness": as_list(model.log_stiffness.weights),
        "log_damping": as_list(model.log_damping.weights),
        "noise_power": as_list(machine.noise_power),
        "quiet_power": as_list(machine.quiet_power),
        "held": accuracy_plain(machine.held),
        "free": accuracy_plain(machine.free),
        "slowest_m_per_s": machine.slowest_m_per_s,
        "fastest_m_per_s": machine.fastest_m_per_s,
        "windows": machine.windows.tolist(),
        "information": as_list(machine.information),
        "swing": machine.swing,
        "amplitude": {name: as_list(getattr(machine.amplitude, name)) for name in InputAmplitude.__dataclass_fields__},
        "delay_s": machine.delay_s,
        "ripple": {name: as_list(getattr(machine.ripple, name)) for name in Ripple.__dataclass_fields__},
        "covariates": _covariates_plain(machine.covariates) if len(machine.covariates) else None,
        "between": _between_plain(machine.between) if machine.between is not None else None,
    }


def _machine(data: BaselinePart, lines: Lines) -> LearnedMachine:
    low, high = data.number("low_m"), data.number("high_m")
    if high < low:
        raise data.wrong("high_m", "below low_m")
    stiffness, damping = (PositionCurve(low, high, data.array(name, 1)) for name in ("log_stiffness", "log_damping"))
    inertia, load, radius = (data.number(name, 0) for name in ("inertia_kg_m2", "load_kg", "radius_m"))
    noise, quiet = data.array("noise_power", 1, least=0), data.array("quiet_power", 1, least=0)
    for name, values, of in (("noise_power", noise, lines.bins), ("quiet_power", quiet, lines.quiet)):
        if len(values) != len(of):
            raise data.wrong(name, f"not {len(of)} numbers")
    return LearnedMachine(
        MovingModel(inertia, load, radius, stiffness, damping),
        noise,
        quiet,
        accuracy_of(data.part("held")),
        accuracy_of(data.part("free")),
        data.number("slowest_m_per_s"),
        data.number("fastest_m_per_s"),
        data.array("windows", 1, least=0).astype(np.int64),
        _information(data),
        _amplitude(data.part("amplitude"), len(lines)),
        data.number("swing", 0),
        _ripple(data.part("ripple")),
        data.number("delay_s"),
        Covariates() if data.value("covariates") is None else _covariates(data.part("covariates")),
        None if data.value("between") is None else _between(data.part("between")),
    )


def _information(data: BaselinePart) -> NDArray[np.float64]:
    information = data.array("information", 1, least=0)
    if information.size != len(DIRECTIONS):
        raise data.wrong("information", f"not {len(DIRECTIONS)} numbers")
    return information


def _amplitude(data: BaselinePart, lines: int) -> InputAmplitude:
    amplitude = InputAmplitude(*(data.array(name, 1, least=0) for name in InputAmplitude.__dataclass_fields__))
    for name in InputAmplitude.__dataclass_fields__:
        if getattr(amplitude, name).size != lines:
            raise data.wrong(name, f"not {lines} numbers")
    return amplitude


def _ripple(data: BaselinePart) -> Ripple:
    cycles_per_m = data.array("cycles_per_m", 1, least=0)
    sizes = {"amplitude_n_m": data.array("amplitude_n_m", 1, least=0)}
    sizes["peak_n_m"] = data.array("peak_n_m", 1, least=0)
    for name, values in sizes.items():
        if values.size != cycles_per_m.size:
            raise data.wrong(name, f"not {cycles_per_m.size} numbers")
    return Ripple(cycles_per_m, **sizes)


def _covariates_plain(covariates: Covariates) -> dict[str, Any]:
    arrays = {name: as_list(getattr(covariates, name)) for name in _COVARIATE_ARRAYS}
    return {"names": list(covariates.names)} | arrays


def _covariates(data: BaselinePart) -> Covariates:
    names = data.texts("names")
    arrays = {name: data.array(name, dimensions) for name, dimensions in _COVARIATE_ARRAYS.items()}
    for name, array in arrays.items():
        shape = (len(DIRECTIONS), *(len(names),) * (array.ndim - 1)) if array.ndim > 1 else (len(names),)
        if array.shape != shape:
            raise data.wrong(name, f"not an array of shape {shape}")
    if np.any(arrays["high"] <= arrays["low"]):
        raise data.wrong("high", "not above low")
    return Covariates(names, **arrays)


def _between_plain(between: BetweenRuns) -> dict[str, Any]:
    return {"direction": as_list(between.direction), "spread": between.spread}


def _between(data: BaselinePart) -> BetweenRuns:
    direction = data.array("direction", 1)
    if direction.size != len(DIRECTIONS) or not direction.any():
        raise data.wrong("direction", f"not {len(DIRECTIONS)} numbers of which one is not 0")
    return BetweenRuns(direction, data.number("spread", 0))
