"""A Baseline as one JSON file: numbers and nested lists, that any tool opens."""

from __future__ import annotations

import json
import os
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.monitoring.accuracy import Accuracy
from livebode.monitoring.baseline import Baseline
from livebode.monitoring.machine import Machine
from livebode.monitoring.table import Table
from livebode.motion import Curve, MovingModel
from livebode.nouns import InputError, Lines

_FORMAT = "livebode baseline"
_VERSION = 1


def save(baseline: Baseline, path: Path) -> None:
    """Write beside its place, and move there when it is whole."""
    text = json.dumps(_plain(baseline), ensure_ascii=False, allow_nan=False, indent=1) + "\n"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.partial-", dir=path.parent)
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(text)
            Path(name).chmod(0o644)
            Path(name).replace(path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise InputError(f"the baseline could not be written to {str(path)!r}: {error.strerror}") from None


def load(path: Path) -> Baseline:
    """Read a file that `save` wrote."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(
            f"there is no baseline {str(path)!r}; make one with `livebode learn RUN --out {path}`"
        ) from None
    except OSError as error:
        raise InputError(f"{str(path)!r} cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise InputError(f"{str(path)!r} is not a baseline: {error}") from None
    if not isinstance(data, dict) or data.get("format") != _FORMAT:
        raise InputError(f"{str(path)!r} is not a baseline; make one with `livebode learn`")
    if data.get("version") != _VERSION:
        raise InputError(
            f"{str(path)!r} is a baseline of version {data.get('version')}, and this livebode reads version {_VERSION}"
            "; learn it again"
        )
    try:
        return _baseline(data)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{str(path)!r} is damaged ({type(error).__name__}: {error}); learn it again") from None


def _plain(baseline: Baseline) -> dict[str, Any]:
    lines = baseline.lines
    return {
        "format": _FORMAT,
        "version": _VERSION,
        "livebode": version("livebode"),
        "runs": list(baseline.runs),
        "lines": {"bins": lines.bins, "quiet": lines.quiet, "window": lines.window, "rate_hz": lines.rate_hz},
        "signals": baseline.signals,
        "estimator": baseline.estimator,
        "quantity": baseline.quantity,
        "corrected": baseline.corrected,
        "machine": _machine_plain(baseline.machine) if baseline.machine else None,
        "remark": baseline.remark,
        "tables": [_table_plain(table) for table in baseline.tables],
    }


def _baseline(data: dict[str, Any]) -> Baseline:
    lines = data["lines"]
    return Baseline(
        Lines(tuple(lines["bins"]), lines["window"], lines["rate_hz"], tuple(lines["quiet"])),
        data["signals"],
        data["estimator"],
        data["quantity"],
        tuple(_table(table) for table in data["tables"]),
        _machine(data["machine"]) if data["machine"] else None,
        data["corrected"],
        tuple(data["runs"]),
        data["remark"],
    )


def _machine_plain(machine: Machine) -> dict[str, Any]:
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
    }


def _machine(data: dict[str, Any]) -> Machine:
    curves = [Curve(data["low_m"], data["high_m"], _array(data[name])) for name in ("log_stiffness", "log_damping")]
    return Machine(
        MovingModel(data["inertia_kg_m2"], data["load_kg"], data["radius_m"], *curves),
        _array(data["noise_power"]),
        _array(data["quiet_power"]),
        _accuracy(data["held"]),
        _accuracy(data["free"]),
        data["slowest_m_per_s"],
        data["fastest_m_per_s"],
        np.array(data["windows"], dtype=np.int64),
    )


def _table_plain(table: Table) -> dict[str, Any]:
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


def _table(data: dict[str, Any]) -> Table:
    real, imaginary = _array(data["mean_re"]), _array(data["mean_im"])
    mean = np.empty(real.shape, dtype=np.complex128)
    mean.real, mean.imag = real, imaginary
    return Table(
        data["what"],
        tuple(data["names"]),
        data["low"],
        data["step"],
        data["still"],
        mean,
        _array(data["covariance"]),
        _array(data["variance"]),
        np.array(data["count"], dtype=np.int64),
        _accuracy(data["accuracy"]),
    )


def _accuracy_plain(known: Accuracy) -> dict[str, Any]:
    return {name: _list(getattr(known, name)) for name in Accuracy.__dataclass_fields__}


def _accuracy(data: dict[str, Any]) -> Accuracy:
    return Accuracy(*(_array(data[name]) for name in Accuracy.__dataclass_fields__))


def _list(array: NDArray[Any]) -> Any:
    """Nested lists, with None for what is not a number."""
    plain = array.astype(object)
    plain[~np.isfinite(array)] = None
    return plain.tolist()


def _array(values: Any) -> NDArray[np.float64]:
    return np.array(values, dtype=np.float64)
