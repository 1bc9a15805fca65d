"""What the command line prints about a command: its help, and how it was used wrongly."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from livebode.cli.commands import panels
from livebode.cli.frames import DIM, RED, frame, paragraph, styled, table, usage


def help_page(command: Any, context: Any, width: int, *, colours: bool) -> str:
    """Usage, description, arguments, options and subcommands of a command of Typer."""
    first, *others = [" ".join(part.split()) for part in _plain(command.help or "").split("\n\n")]
    lines = ["", usage(_usage(context), colours=colours), "", *paragraph(first, width), ""]
    for part in others:
        lines += [*(styled(line, DIM, colours=colours) for line in paragraph(part, width)), ""]
    for title, rows in _tables(command, context):
        lines += table(title, rows, width, colours=colours)
    return "\n".join(lines)


def error_page(error: Any, width: int, *, colours: bool) -> str:
    """Usage of the command and what is wrong."""
    lines = []
    context = getattr(error, "ctx", None)
    if context is not None:
        lines = [usage(_usage(context), colours=colours).strip(), f"Try '{context.command_path} --help' for help."]
    message = [("", line[1:]) for line in paragraph(error.format_message(), width - 3)]
    return "\n".join([*lines, *frame("Error", message, width, colours=colours, border=RED)])


def _usage(context: Any) -> str:
    return " ".join([context.command_path, *context.command.collect_usage_pieces(context)])


def _tables(command: Any, context: Any) -> Iterator[tuple[str, list[tuple[str, str]]]]:
    for title, kind in (("Arguments", "argument"), ("Options", "option")):
        found = [one.get_help_record(context) for one in command.get_params(context) if one.param_type_name == kind]
        if rows := [(names, " ".join(_plain(text).split())) for names, text in filter(None, found)]:
            yield title, rows
    yield from panels(getattr(command, "table", {})).items()


def _plain(text: str) -> str:
    """Without the escapes before brackets: the completion of some shells has Rich render the texts."""
    return text.replace("\\[", "[")
