"""A mechanism is in one place: whoever needs it again finds it there."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCES = (ROOT / "src/livebode", *ROOT.glob("wings/*/src"))


@pytest.mark.parametrize(
    ("pattern", "places"),
    [
        # The copy of a file at a URL has no place.
        (
            r"os\.(replace|rename)\(|\w\.rename\(|mk[sd]temp\(",
            {"core/files.py", "locations/copies.py"},
        ),
        # Data that is sent from a file, or read back at once, has no place.
        (
            r"(TemporaryDirectory|NamedTemporaryFile)\(",
            {
                *("dashboard/app.py", "export/universal.py", "livebode_reports/pdf.py"),
                "livebode_control/validation/validate_command.py",
                *(f"livebode_plant/{name}.py" for name in ("archive/alone", "archive/tasks", "lake/compaction")),
                "livebode_plant/cli/fleet/run_command.py",
            },
        ),
        # An upload is synced where it is received, and not in the thread that serves the pages.
        (r"\bfsync\(", {"core/files.py", "doctor/computer.py", "livebode_start/uploads.py"}),
        # A record that is paused at its end raises without an error of the system.
        (r'"not-written",\n', {"records/segments/store.py"}),
        (r'"not-written", ', {"core/write_errors.py"}),
        (r"get_close_matches\(", {"core/_block.py"}),
        (r"tomllib\.loads?\(", {"configuration/toml_file.py"}),
        # The standard one compiles six functions a class while a module is loaded.
        (r"^(from dataclasses import .*\bdataclass\b|import dataclasses)|dataclasses\.dataclass\(", set()),
        (r"""["']s["'] (\*|if)|\}s["']$""", {"core/_wording.py"}),
    ],
)
def test_a_mechanism_is_in_one_place(pattern: str, places: set[str]) -> None:
    found = {
        path.relative_to(source).as_posix()
        for source in SOURCES
        for path in source.rglob("*.py")
        if any(re.search(pattern, line + "\n") for line in path.read_text("utf-8").split("\n") if ">>>" not in line)
    }
    assert found == places


def test_no_two_public_classes_share_a_name() -> None:
    """A name in a traceback, a message or a review then means one thing."""
    names = Counter(
        name
        for source in SOURCES
        for path in source.rglob("*.py")
        for name in re.findall(r"^class ([A-Z]\w*)", path.read_text("utf-8"), re.MULTILINE)
    )
    assert [name for name, count in names.items() if count > 1] == []
