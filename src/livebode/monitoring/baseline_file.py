"""A Baseline as one JSON file: numbers and nested lists, readable by any tool."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import BaselineError, Lines, LivebodeError
from livebode.core.files import write_whole
from livebode.core.writing import writing
from livebode.monitoring.accuracy import ChangeAccuracy
from livebode.monitoring.baseline_part import BaselinePart
from livebode.monitoring.baseline_version import BaselineVersion
from livebode.monitoring.between_runs import BetweenRuns
from livebode.monitoring.covariates import Covariates
from livebode.monitoring.machine import LearnedMachine
from livebode.monitoring.ripple import Ripple
from livebode.monitoring.sensitivity import DIRECTIONS
from livebode.monitoring.table import ScheduleTable
from livebode.motion import MovingModel, PositionCurve
from livebode.version import __version__

ROLES = ("output", "input", "excitation", "schedule")

_FORMAT = "livebode baseline"
_VERSION = 4
_ID_DIGITS = 16
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
    text = json.dumps(_plain(baseline), ensure_ascii=False, allow_nan=False, indent=1) + "\n"
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
        data = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise BaselineError("absent", f"there is no baseline {str(path)!r}", _LEARN, path=str(path)) from None
    except OSError as error:
        raise BaselineError(
            "unreadable",
            f"{str(path)!r} cannot be read: {error.strerror}",
            "check its permissions",
            path=str(path),
            reason=error.strerror,
        ) from None
    except ValueError as error:
        raise BaselineError(
            "not-a-baseline", f"{str(path)!r} is not a baseline: {error}", _LEARN, path=str(path), reason=str(error)
        ) from None
    if not isinstance(data, dict) or data.get("format") != _FORMAT:
        raise BaselineError("not-a-baseline", f"{str(path)!r} is not a baseline", _LEARN, path=str(path))
    found = data.get("version")
    if type(found) is int and found > _VERSION:
        raise BaselineError(
            "newer-version",
            f"{str(path)!r} has version {found} of its format, and this livebode reads version {_VERSION}",
            "update livebode",
            path=str(path),
            found=found,
            readable=_VERSION,
        )
    if found != _VERSION:
        raise BaselineError(
            "version",
            f"{str(path)!r} is a baseline of version {found}, and this livebode reads version {_VERSION}",
            "learn it again",
            path=str(path),
            version=found,
        )
    return _fields(BaselinePart(str(path), "", data))


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
        "tables": [_table_plain(table) for table in baseline["tables"]],
    }


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
    tables = tuple(_table(table) for table in data.parts("tables"))
    if not tables:
        raise data.wrong("tables", "empty")
    signals = data.part("signals")
    hop = data.whole("hop")
    if hop < 1:
        raise data.wrong("hop", "below 1")
    fields = {
        "lines": lines,
        "hop": hop,
        "signals": {role: signals.value(role) and signals.text(role) for role in ROLES},
        "estimator": data.text("estimator"),
        "quantity": data.text("quantity"),
        "tables": tables,
        "machine": None if data.value("machine") is None else _machine(data.part("machine"), lines),
        "corrected": data.truth("corrected"),
        "runs": data.texts("runs"),
        "remark": data.text("remark"),
        "learned": data.text("learned") if data.has("learned") else "",
        "reason": data.text("reason") if data.has("reason") else "",
        "history": tuple(map(_version, data.parts("history"))) if data.has("history") else (),
    }
    if data.has("id") and data.text("id") != id_of(fields):
        raise data.wrong("id", f"not that of its content, {id_of(fields)}: it was changed after it was learned")
    return fields


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
        "log_stiffness": _list(model.log_stiffness.weights),
        "log_damping": _list(model.log_damping.weights),
        "noise_power": _list(machine.noise_power),
        "quiet_power": _list(machine.quiet_power),
        "held": _accuracy_plain(machine.held),
        "free": _accuracy_plain(machine.free),
        "slowest_m_per_s": machine.slowest_m_per_s,
        "fastest_m_per_s": machine.fastest_m_per_s,
        "windows": machine.windows.tolist(),
        "delay_s": machine.delay_s,
        "ripple": {name: _list(getattr(machine.ripple, name)) for name in Ripple.__dataclass_fields__},
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
        _accuracy(data.part("held")),
        _accuracy(data.part("free")),
        data.number("slowest_m_per_s"),
        data.number("fastest_m_per_s"),
        data.array("windows", 1, least=0).astype(np.int64),
        _ripple(data.part("ripple")),
        data.number("delay_s"),
        Covariates() if data.value("covariates") is None else _covariates(data.part("covariates")),
        None if data.value("between") is None else _between(data.part("between")),
    )


def _ripple(data: BaselinePart) -> Ripple:
    ripple = Ripple(*(data.array(name, 1, least=0) for name in Ripple.__dataclass_fields__))
    if ripple.cycles_per_m.size != ripple.amplitude_n_m.size:
        raise data.wrong("amplitude_n_m", f"not {ripple.cycles_per_m.size} numbers")
    return ripple


def _covariates_plain(covariates: Covariates) -> dict[str, Any]:
    arrays = {name: _list(getattr(covariates, name)) for name in _COVARIATE_ARRAYS}
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
    return {"direction": _list(between.direction), "spread": between.spread}


def _between(data: BaselinePart) -> BetweenRuns:
    direction = data.array("direction", 1)
    if direction.size != len(DIRECTIONS) or not direction.any():
        raise data.wrong("direction", f"not {len(DIRECTIONS)} numbers of which one is not 0")
    return BetweenRuns(direction, data.number("spread", 0))


def _table_plain(table: ScheduleTable) -> dict[str, Any]:
    return {
        "what": table.what,
        "names": list(table.names),
        "low": table.low,
        "step": table.step,
        "still": table.still,
        "ways": ["back", "still", "forth"],
        "mean_re": _list(table.mean.real),
        "mean_im": _list(table.mean.imag),
        "covariance": _list(table.covariance),
        "variance": _list(table.variance),
        "count": table.count.tolist(),
        "accuracy": _accuracy_plain(table.accuracy),
    }


def _table(data: BaselinePart) -> ScheduleTable:
    real, imaginary = data.array("mean_re", 3, known=False), data.array("mean_im", 3, known=False)
    if real.shape != imaginary.shape:
        raise data.wrong("mean_im", "not of the shape of mean_re")
    mean = np.empty(real.shape, dtype=np.complex128)
    mean.real, mean.imag = real, imaginary
    return ScheduleTable(
        data.text("what"),
        data.texts("names"),
        data.number("low"),
        data.number("step"),
        data.number("still"),
        mean,
        data.array("covariance", 5, known=False),
        data.array("variance", 3, known=False),
        data.array("count", 2, least=0).astype(np.int64),
        _accuracy(data.part("accuracy")),
    )


def _accuracy_plain(known: ChangeAccuracy) -> dict[str, Any]:
    return {name: _list(getattr(known, name)) for name in ChangeAccuracy.__dataclass_fields__}


def _accuracy(data: BaselinePart) -> ChangeAccuracy:
    return ChangeAccuracy(*(data.array(name, 1, least=0, known=False) for name in ChangeAccuracy.__dataclass_fields__))


def _list(array: NDArray[Any]) -> Any:
    """Nested lists, with None for NaN and infinity."""
    plain = array.astype(object)
    plain[~np.isfinite(array)] = None
    return plain.tolist()
