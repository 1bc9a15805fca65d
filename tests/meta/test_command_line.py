"""The page of commands is that of the command line."""

from __future__ import annotations

import re
from pathlib import Path

from tools.command_line import page

ROOT = Path(__file__).parents[2]


def test_the_page_of_commands_is_what_the_command_line_prints() -> None:
    """If not: `python -m tools.command_line > docs/reference/command-line.md`."""
    assert (ROOT / "docs" / "reference" / "command-line.md").read_text("utf-8") == page()


def test_no_option_states_its_default_or_limits_twice() -> None:
    assert re.findall(r"^\| `([^`]+)` .*(\[[^]]+\]) \2", page(), re.MULTILINE) == []
