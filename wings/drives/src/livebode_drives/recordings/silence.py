"""What libraries print about damaged files."""

from __future__ import annotations

from types import ModuleType


def silence(*modules: ModuleType) -> None:
    """Let modules of a library print nothing about damaged files; the error that follows has what matters.

    To redirect standard output would also swallow what other threads print.
    """
    for module in modules:
        module.print = _nothing  # type: ignore[attr-defined]


def _nothing(*_: object, **__: object) -> None:
    """What a silenced module calls as print."""
