"""The last line of a command: the command that a person would want next."""

from __future__ import annotations

import sys

from livebode.cli.shell import command_line
from livebode.locations import original


class NextCommand:
    """What a command returns, so that its last line is the command that a person would want next, to be copied.

    It is printed unless the command was called with --json, or the wing of the next one is not installed.

    Parameters
    ----------
    words
        Name, arguments and flags. A local copy of a URL is printed as the URL.
    options
        Options by the name of their parameter; one that is None is left out.

    >>> NextCommand("report", "runs/my axis", entry="velocity/u", on=None).line
    "Next: livebode report 'runs/my axis' --entry velocity/u"
    """

    def __init__(self, *words: object, **options: object) -> None:
        given = {name: value for name, value in options.items() if value is not None}
        named = [word for name, value in given.items() for word in (f"--{name.replace('_', '-')}", value)]
        self._words = [original(str(word)) for word in (*words, *named)]

    @classmethod
    def again(cls, **options: object) -> NextCommand:
        """The command that runs now, with these options added."""
        return cls(*sys.argv[1:], **options)

    @property
    def line(self) -> str | None:
        """The line; None if the command is not installed."""
        from livebode.plugins import named

        is_known = self._words[0] in named("commands")
        return f"Next: {command_line('livebode', *self._words)}" if is_known else None
