"""A command as a person can paste it into the shell."""

from __future__ import annotations

import os
import shlex
import subprocess


def command_line(*words: str) -> str:
    """The words of a command, quoted where the shell would divide or replace them.

    >>> command_line("livebode", "run", "axis.toml")
    'livebode run axis.toml'
    """
    return subprocess.list2cmdline(words) if os.name == "nt" else shlex.join(words)
