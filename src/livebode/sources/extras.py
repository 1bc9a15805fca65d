"""Packages that read a format: the error of one that is not installed, and what damaged files let them print."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

from livebode.core import ExtraError
from livebode.core.installing import not_installed


def missing(path: Path, package: str, extra: str) -> ExtraError:
    return not_installed(
        f"{path} needs the package {package}, which is not installed", package=package, extra=extra, path=str(path)
    )


def silence(*modules: ModuleType) -> None:
    """Let modules of a library print nothing about damaged files; the error that follows has what matters.

    To redirect standard output would also swallow what other threads print.
    """
    for module in modules:
        module.print = _nothing  # type: ignore[attr-defined]


def _nothing(*_: object, **__: object) -> None:
    """What a silenced module calls as print."""
