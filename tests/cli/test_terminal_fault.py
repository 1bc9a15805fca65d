"""Nothing that a file, a sender or a user names can command the terminal; colours are the plot's and Rich's alone."""

from __future__ import annotations

import json
import re
from pathlib import Path

import h5py
import pytest
from hypothesis import given
from hypothesis import strategies as st

from livebode.cli.frames import visible
from tests.support.command import livebode, signals
from tests.support.terminals import on_terminal

EVIL = "\x1b[2J\x1b]0;owned\x07\x9b31m\u202e"
SHOWN = r"\u001b[2J\u001b]0;owned\u0007\u009b31m\u202e"
OURS = re.compile(r"\x1b\[[0-9;]*m|\x1b\[\?25[lh]|\x1b\[[0-9]*[AK]|\x1b\[2K")
"""What Rich and the plot write: colours, the cursor hidden and shown, lines taken back."""


@pytest.fixture(scope="module")
def evil(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording whose channels have names that clear a screen and set a title."""
    path = tmp_path_factory.mktemp("evil") / "a.h5"
    with h5py.File(path, "w") as file:
        for name, values in signals().items():
            file[name if name == "t" else name + EVIL] = values
    return path


def shown(*arguments: object) -> str:
    """What the command writes to a terminal, standard error included."""
    return on_terminal(*arguments, columns=300)[1]


@pytest.fixture(scope="module")
def tracked(evil: Path) -> tuple[Path, str]:
    """A run on it, and what the terminal got."""
    out = evil.parent / "run"
    channels = ["--excitation", f"w{EVIL}", "--input", f"u{EVIL}", "--output", f"y{EVIL}"]
    return out, shown("run", evil, *channels, "--lines", "50,100,200", "--window", "100", "--out", out)


def is_harmless(text: str) -> bool:
    left = OURS.sub("", text).replace("\r", "")
    return visible(left) == left


def test_a_recordings_names_do_not_command_the_terminal(evil: Path, tracked: tuple[Path, str]) -> None:
    named = [shown("inspect", evil), shown("inspect", evil, "--excitation", f"no{EVIL}")]
    others = [tracked[1], shown(f"no{EVIL}")]
    assert all(map(is_harmless, named + others))
    assert all(SHOWN in text for text in named)
    assert "\x1b[" in tracked[1]  # the plot has its colours


def test_events_of_a_stored_run_do_not_command_the_terminal(tracked: tuple[Path, str]) -> None:
    event = {"kind": "gap", "sample": 1, "time_s": 0.1, "message": EVIL, "details": {}}
    (tracked[0] / "events.jsonl").write_text(json.dumps(event) + "\n")
    text = shown("export", tracked[0], "--sql", f"select message, 'x{EVIL}' as x from events")
    assert is_harmless(text)


def test_the_help_has_colours_on_a_terminal_and_nowhere_else() -> None:
    text = shown("export", "--help")
    assert is_harmless(text)
    assert "\x1b[1;33mUsage: " in text
    assert "\x1b" not in livebode("export", "--help").out


@given(st.text())
def test_visible_text_has_no_control_characters_and_is_the_same_without_them(text: str) -> None:
    shown = visible(text)
    assert visible(shown) == shown
    assert not any((letter < " " and letter not in "\n\t") or "\x7f" <= letter < "\xa0" for letter in shown)
    if text.isprintable():
        assert shown == text
