"""Packages that read a format: the error of one that is not installed."""

from __future__ import annotations

from pathlib import Path

from livebode.core import ExtraError, not_installed


def missing(path: Path, package: str, extra: str) -> ExtraError:
    return not_installed(
        f"{path} needs the package {package}, which is not installed", package=package, extra=extra, path=str(path)
    )
