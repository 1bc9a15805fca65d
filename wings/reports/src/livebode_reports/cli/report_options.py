"""Options of the first page that `livebode report` and `livebode compare` share."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from livebode.core import UsageError, errors_of

if TYPE_CHECKING:
    from livebode.configuration import ReportSection

_LETTERS_MAX = 500
_ASKED = {
    "machine": "Machine", "serial_number": "Serial number", "operator": "Operator", "company": "Company",
    "customer": "Customer", "conditions": "Conditions",
}  # fmt: skip


FIRST_PAGE = {
    **{key: ("--" + key.replace("_", "-"), "TEXT") for key in _ASKED},
    "logo": ("--logo", "FILE"),
    "paper": ("--paper", "SIZE"),
}
"""Option and metavar of each key of [report] that an option sets."""
Template = Annotated[
    Path | None,
    typer.Option(
        "--template", metavar="FILE", help="TOML file with a \\[report]: first page and limits for many machines."
    ),
]
Ask = Annotated[bool, typer.Option("--ask", help="Ask on the terminal for what the first page lacks.")]
Appendix = Annotated[bool, typer.Option("--appendix", help="Add the raw configuration and the versions.")]


def header(recorded: ReportSection, template: Path | None, ask: bool, specified: dict[str, Any]) -> ReportSection:
    """The first page and the limits: the options, then those asked for, the template, and the recorded ones.

    Raises
    ------
    ConfigError
        If the template or the value of an option cannot be used.
    UsageError
        If --ask is used without a terminal.
    """
    header = recorded
    if template is not None:
        from livebode.configuration import read_template

        used = read_template(template)
        header = header.over({name: getattr(used, name) for name in used.model_fields_set})
    header = header.over(_checked(specified))
    return header.over(_checked(_answers(header))) if ask else header


def _checked(specified: dict[str, Any]) -> dict[str, Any]:
    """The values as a file could have them."""
    from livebode.configuration import ReportSection, report_error

    for text in specified.values():
        if isinstance(text, str) and (len(text) > _LETTERS_MAX or not text.isprintable()):
            raise UsageError(
                "unreadable",
                f"a text for the first page has more than {_LETTERS_MAX} letters, or one that cannot be printed",
                "shorten it to one line",
                value=text[:_LETTERS_MAX],
            )
    try:
        ReportSection.model_validate(specified)
    except ValueError as error:
        raise report_error(errors_of(error)[0]) from None
    return specified


def _answers(header: ReportSection) -> dict[str, str]:
    if not sys.stdin.isatty():
        raise UsageError(
            "conflict",
            "--ask needs a terminal, and the standard input is none",
            "use the options --machine, --serial-number and so on, or a --template",
            argument="--ask",
        )
    missing = {name: words for name, words in _ASKED.items() if not getattr(header, name)}
    return {
        name: typer.prompt(f"{words} (Enter: none)", default="", show_default=False, err=True)
        for name, words in missing.items()
    }
