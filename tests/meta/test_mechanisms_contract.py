"""A mechanism is in one place: whoever needs it again finds it there."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[2] / "src/livebode"


@pytest.mark.parametrize(
    ("pattern", "places"),
    [
        # The journal of a damaged segment is only set aside; the copy of a file at a URL has no place.
        (
            r"os\.(replace|rename)\(|\w\.rename\(|mk[sd]temp\(",
            {"core/files.py", "records/segments/journal.py", "locations/copies.py"},
        ),
        # Data that is sent from a file, or read back at once, has no place.
        (
            r"(TemporaryDirectory|NamedTemporaryFile)\(",
            {
                *("cli/fleet/demo_command.py", "cli/validate_command.py", "dashboard/app.py", "export/universal.py"),
                *("archive/alone.py", "archive/tracking.py", "report/pdf.py"),
            },
        ),
        (r"\bfsync\(", {"core/files.py", "doctor/disk.py"}),
        # A record that is paused at its end raises without an error of the system.
        (r'"not-written",\n', {"records/segments/store.py"}),
        (r'"not-written", ', {"core/writing.py"}),
        (r"get_close_matches\(", {"core/_block.py"}),
        (r"tomllib\.loads?\(", {"configuration/toml_file.py"}),
        (r"""["']s["'] (\*|if)|\}s["']$""", {"core/_wording.py"}),
    ],
)
def test_a_mechanism_is_in_one_place(pattern: str, places: set[str]) -> None:
    found = {
        path.relative_to(SOURCE).as_posix()
        for path in SOURCE.rglob("*.py")
        if any(re.search(pattern, line + "\n") for line in path.read_text("utf-8").split("\n") if ">>>" not in line)
    }
    assert found == places


def test_no_two_public_classes_share_a_name() -> None:
    """A name in a traceback, a message or a review then means one thing."""
    names = Counter(
        name
        for path in SOURCE.rglob("*.py")
        for name in re.findall(r"^class ([A-Z]\w*)", path.read_text("utf-8"), re.MULTILINE)
    )
    assert [name for name, count in names.items() if count > 1] == []
