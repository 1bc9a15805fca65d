"""Tables of a baseline in its file."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.language import Message
from livebode.monitoring.accuracy import ChangeAccuracy
from livebode.monitoring.baseline_part import BaselinePart
from livebode.monitoring.table import ScheduleTable


def table_plain(table: ScheduleTable) -> dict[str, Any]:
    """Plain data of it, for JSON."""
    return {
        "what": table.what,
        "names": [name.plain() if isinstance(name, Message) else name for name in table.names],
        "low": table.low,
        "step": table.step,
        "still": table.still,
        "ways": ["back", "still", "forth"],
        "mean_re": as_list(table.mean.real),
        "mean_im": as_list(table.mean.imag),
        "covariance": as_list(table.covariance),
        "variance": as_list(table.variance),
        "count": table.count.tolist(),
        "accuracy": accuracy_plain(table.accuracy),
    } | ({"unit": table.unit} if table.unit else {})


def table_of(data: BaselinePart) -> ScheduleTable:
    """From plain data; BaselineError where it is damaged."""
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
        accuracy_of(data.part("accuracy")),
        data.text("unit") if data.has("unit") else "",
    )


def accuracy_plain(known: ChangeAccuracy) -> dict[str, Any]:
    """Plain data of it, for JSON."""
    return {name: as_list(getattr(known, name)) for name in ChangeAccuracy.__dataclass_fields__}


def accuracy_of(data: BaselinePart) -> ChangeAccuracy:
    """From plain data; BaselineError where it is damaged."""
    return ChangeAccuracy(*(data.array(name, 1, least=0, known=False) for name in ChangeAccuracy.__dataclass_fields__))


def as_list(array: NDArray[Any]) -> Any:
    """Nested lists, with None for NaN and infinity."""
    plain = array.astype(object)
    plain[~np.isfinite(array)] = None
    return plain.tolist()
