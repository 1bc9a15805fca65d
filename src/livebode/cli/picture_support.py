"""What a command does without Matplotlib: everything but its pictures."""

from __future__ import annotations

from importlib.util import find_spec

from livebode.core import install_command


def can_draw() -> bool:
    """Whether Matplotlib is installed."""
    return find_spec("matplotlib") is not None


def tell_how_to_draw() -> None:
    """Print how to get pictures, where there are none."""
    if not can_draw():
        print(f"no pictures, because Matplotlib is not installed; run {install_command('plots')}")
