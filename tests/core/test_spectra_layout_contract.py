"""SpectraLayout: what a drive's spectra can be of."""

from __future__ import annotations

import pytest

from livebode.core import Channel, GridError, LivebodeError, SpectraLayout, UsageError
from tests.support.errors import refused

SIGNALS = (Channel("y", "rad/s"), Channel("u", "N m"), Channel("w", "N m"))


@pytest.mark.parametrize(
    ("options", "kind", "code", "facts"),
    [
        ({"signals": ()}, UsageError, "missing", {"argument": "signals"}),
        ({"signals": (Channel("y"), Channel("y", "m"))}, UsageError, "duplicate", {"argument": "signals"}),
        ({"values": (Channel("y", "deg"),)}, UsageError, "duplicate", {"argument": "signals"}),
        ({"window": 2}, GridError, "window-out-of-range", {"window": 2}),
        ({"hop": 30}, GridError, "hop-off", {"hop": 30, "window": 400}),
        ({"hop": 0}, GridError, "hop-off", {"hop": 0}),
        ({"lines": ()}, GridError, "no-line", {}),
        ({"lines": (4, 2)}, GridError, "bins-unordered", {"bins": [4, 2]}),
        ({"lines": (2, 200)}, GridError, "above-nyquist", {"bin": 200, "window": 400}),
        ({"quiet": (2,)}, GridError, "line-duplicated", {"bin": 2}),
        ({"subtracted": (1.0,)}, UsageError, "wrong-shape", {"argument": "subtracted"}),
        ({"subtracted": (1.0, float("nan"), 0.0)}, UsageError, "not-finite", {"argument": "subtracted"}),
    ],
)
def test_inconsistent_layouts_are_refused(options: dict, kind: type[LivebodeError], code: str, facts: dict) -> None:
    given = {"signals": SIGNALS, "values": (), "window": 400, "hop": 20, "lines": (2, 4)} | options
    with refused(kind, code, **facts):
        SpectraLayout(**given)
