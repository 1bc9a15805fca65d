"""Options of the first page that `livebode report` and `livebode compare` share."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from livebode.cli import key_help
from livebode.core import UsageError

if TYPE_CHECKING:
    from livebode.configuration import ReportSection

_LETTERS_MAX = 500
_ASKED = {
    "machine": "Machine", "serial_number": "Serial number", "operator": "Operator", "company": "Company",
    "customer": "Customer", "conditions": "Conditions",
}  # fmt: skip


def _text(text: str | None) -> str | None:
    if text is not None and (len(text) > _LETTERS_MAX or not text.isprintable()):
        raise UsageError(
            "unreadable",
            f"a text for the first page has more than {_LETTERS_MAX} letters, or one that cannot be printed",
            "shorten it to one line",
            value=text[:_LETTERS_MAX],
        )
    return text


def _option(key: str) -> Any:
    names = "--" + key.replace("_", "-")
    return typer.Option(names, metavar="TEXT", callback=_text, help=key_help(f"report.{key}"))


def _paper(name: str | None) -> str | None:
    papers = ("a4", "letter")
    if name is not None and name not in papers:
        raise UsageError(
            "not-one-of",
            f"--paper={name!r} is not one of the sizes",
            f"choose {', '.join(papers)}",
            argument="--paper", value=name, allowed=list(papers),
        )  # fmt: skip
    return name


Machine = Annotated[str | None, _option("machine")]
SerialNumber = Annotated[str | None, _option("serial_number")]
Operator = Annotated[str | None, _option("operator")]
Company = Annotated[str | None, _option("company")]
Customer = Annotated[str | None, _option("customer")]
Conditions = Annotated[str | None, _option("conditions")]
LogoFile = Annotated[Path | None, typer.Option("--logo", metavar="FILE", help=key_help("report.logo"))]
PaperSize = Annotated[
    str | None, typer.Option("--paper", metavar="SIZE", callback=_paper, help="a4 or letter. \\[default: a4]")
]
Template = Annotated[
    Path | None,
    typer.Option(
        "--template", metavar="FILE", help="TOML file with a \\[report]: first page and limits for many machines."
    ),
]
Ask = Annotated[bool, typer.Option("--ask", help="Ask on the terminal for what the first page lacks.")]
Appendix = Annotated[bool, typer.Option("--appendix", help="Add the raw configuration and the versions.")]


def header(recorded: ReportSection, template: Path | None, ask: bool, options: dict[str, Any]) -> ReportSection:
    """The first page and the limits: the options, then those asked for, the template, and the recorded ones.

    Raises
    ------
    ConfigError
        If the template cannot be used.
    UsageError
        If --ask is used without a terminal.
    """
    header = recorded
    if template is not None:
        from livebode.configuration import read_template

        used = read_template(template)
        header = header.over({name: getattr(used, name) for name in used.model_fields_set})
    header = header.over(options)
    return header.over(_answers(header)) if ask else header


def _answers(header: ReportSection) -> dict[str, str | None]:
    if not sys.stdin.isatty():
        raise UsageError(
            "conflict",
            "--ask needs a terminal, and the standard input is none",
            "use the options --machine, --serial-number and so on, or a --template",
            argument="--ask",
        )
    missing = {name: words for name, words in _ASKED.items() if not getattr(header, name)}
    return {
        name: _text(typer.prompt(f"{words} (Enter: none)", default="", show_default=False, err=True))
        for name, words in missing.items()
    }
