"""The configuration that a run was made with, read back from its run.json."""

from __future__ import annotations

from typing import Any


def said(summary: dict[str, Any]) -> dict[str, Any]:
    """The configuration without what was left open: JSON has no infinity and writes it, as it writes none, as null.

    >>> said({"configuration": {"loop": {"velocity": {"gain": 1.0, "integral_time_s": None}}, "fit": None}})
    {'loop': {'velocity': {'gain': 1.0}}}
    """
    return dict(_kept(summary.get("configuration", {})))


def _kept(values: dict[str, Any]) -> dict[str, Any]:
    kept = {name: value for name, value in values.items() if value is not None}
    return {name: _kept(value) if isinstance(value, dict) else value for name, value in kept.items()}
