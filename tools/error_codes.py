"""`python -m tools.error_codes > docs/reference/errors.md`: the page of error codes, from the classes."""

from __future__ import annotations

import inspect

from livebode.core import LivebodeError

HEAD = """# Errors and their codes

Every error that livebode raises on purpose is a `LivebodeError` of one of these classes. It has a stable `code`, a
`message`, a `remedy` and its `facts`, each of which is also an attribute; `as_dict()` gives them as plain data. A code
never changes its meaning; new ones may come.

On the command line an error is one line on standard error, and the exit code is 2: the request is wrong as it is, and
would be again. The exit code is 75 (`EX_TEMPFAIL`) where the same request may succeed later: for the codes marked with
an asterisk, and for any error whose fact `errno` is that of a full or failing disk, of a resource that others use now,
or of a network or device that does not answer. `temporary` is this as an attribute. The line names the options of the
command that it is about. With `--json` the last line on standard error is an object instead, with these options, or
what else the sentence is about, as facts:

    $ livebode run standstill.csv --output speed --json
    {"error": {"code": "recording.channel-unknown", "place": "standstill.csv", "message": "there is no channel 'speed'",
    "remedy": "Channels: t, w, u, velocity", "facts": {"channel": "speed", "channels": ["t", "w", "u", "velocity"]}}}

Two codes have no class: `internal` is an internal error (exit code 1, its traceback is a fact), and `stopped`, in the
list of several axes, an axis that somebody ended.
"""


def page() -> str:
    """The page in Markdown."""
    kinds = sorted(LivebodeError.__subclasses__(), key=lambda kind: kind.__name__)
    return "\n".join([HEAD, *map(_section, kinds)])


def _section(kind: type[LivebodeError]) -> str:
    codes = "\n".join(
        f"| `{kind.area}.{code}`{' *' if code in kind.temporary_codes else ''} | {text} |"
        for code, text in kind.codes.items()
    )
    meaning = (inspect.getdoc(kind) or "").partition("\n\nExamples\n")[0]
    return f"## {kind.__name__}\n\n{meaning}\n\n| code | meaning |\n|---|---|\n{codes}\n"


if __name__ == "__main__":
    print(page(), end="")
