"""The error of a recording whose package is not installed."""

from __future__ import annotations

from pathlib import Path

from livebode.core import ExtraError


def missing(path: Path, package: str, extra: str) -> ExtraError:
    return ExtraError(
        "not-installed",
        f"{path} needs the package {package}, which is not installed",
        f"run pip install livebode[{extra}]",
        package=package,
        extra=extra,
        path=str(path),
    )
