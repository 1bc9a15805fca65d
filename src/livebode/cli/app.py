"""The command line.

Exit codes: 0 success, 1 internal error, 2 wrong as it is, 3 no model fits, 4 a limit is not met (report --check), 75
what may pass, 130 and above stopped by a signal.
"""

from __future__ import annotations

import logging
import os
import signal
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from typing import Any, cast

import typer
from typer.core import TyperCommand, TyperGroup

from livebode.cli.commands import ABOUT, OPTIONS, Command
from livebode.cli.failures import disk_full, failure_of, json_requested, name_options, unparsed
from livebode.cli.log_options import File, Level, LogOptions, logged
from livebode.cli.next_step import NextCommand
from livebode.cli.plain_values import LeftToTyperError, plain_value
from livebode.cli.remote import with_copies
from livebode.cli.terminal import print_page, protect
from livebode.core import DamageWarning, LivebodeError
from livebode.plugins import PluginWarning, loaded, named, wings_left_out
from livebode.version import __version__

_HELP = {"help_option_names": ["--help", "-h"]}
_OPTIONS = {names.split()[0] for names in OPTIONS}
_BEFORE = ("--log-level", "--log-file")
_ENDING = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]


class _Light:
    """A command of Typer that loads neither Rich nor pydantic for its help, a completion or a wrong option."""

    def make_context(self, *args: Any, **extra: Any) -> Any:
        """Make the context; pydantic's name of the error is not part of the sentence."""
        try:
            return super().make_context(*args, **extra)  # type: ignore[misc]
        except typer.TyperException as error:
            error.message = error.message.removeprefix("Value error, ")
            raise

    def get_params(self, ctx: Any) -> list[Any]:
        """The arguments and options, also --help."""
        found: list[Any] = super().get_params(ctx)  # type: ignore[misc]
        _leave_missing(found)
        return found

    def format_help(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002
        """Print the help."""
        from livebode.cli.command_help import help_page

        print_page(lambda width, colours: help_page(self, ctx, width, colours=colours))


def _leave_missing(parameters: Iterable[Any]) -> None:
    """Pass by what was not given or is plain: Typer would build a model of pydantic for each option."""
    for parameter in parameters:
        if "process_value" not in vars(parameter):
            parameter.process_value = partial(_processed, parameter, parameter.process_value)


def _processed(parameter: Any, process: Callable[[Any, Any], Any], context: Any, value: Any) -> Any:
    several = parameter.multiple or parameter.nargs == -1
    if value is None:
        if parameter.required and not context.resilient_parsing:
            return process(context, value)
        plain: Any = () if several else None
    else:
        described = parameter.type_descriptor
        try:
            plain = plain_value(value, described.annotation, described.parameter_info)
        except LeftToTyperError:
            return process(context, value)
        if several and not plain and parameter.required:
            return process(context, value)
    return plain if parameter.callback is None else parameter.callback(context, parameter, plain)


class _Command(_Light, TyperCommand):
    """One command, with help in colour and errors that name its options."""

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        """Make the context; with --json, an invalid option is an error with a code."""
        try:
            return super().make_context(info_name, args, parent, **extra)
        except typer.Exit:
            raise
        except Exception as error:
            if (option := getattr(error, "option_name", "")) in _BEFORE:
                error.message = f"{option} stands before the command: livebode {option} … {info_name} …"  # type: ignore[attr-defined]
            if not json_requested() or not hasattr(error, "format_message"):
                raise
            raise unparsed(error, info_name) from None

    def invoke(self, ctx: Any) -> Any:
        """Run the command; an error names the options that it concerns."""
        group = ctx.parent.command if ctx.parent else None
        extra = group.extra if isinstance(group, _Group) else ""
        arrow: AbstractContextManager[None] = nullcontext()
        if group and extra:
            from livebode.core import needing

            arrow = needing("PyArrow", extra, f"the command {group.name}")
        module = self.callback.__module__ if self.callback else __name__
        try:
            with arrow, logged(ctx.info_name, module, ctx.obj):
                result = super().invoke(ctx)
        except LivebodeError as error:
            name_options(error, self.params)
            raise
        if isinstance(result, NextCommand) and not json_requested() and result.line is not None:
            print(result.line)


class _Commands(Mapping[str, TyperCommand]):
    """The commands of a table by name; the module of one is loaded when it is used."""

    def __init__(self, table: Mapping[str, Command]) -> None:
        self._table = table

    def __getitem__(self, name: str) -> Any:
        command = self._table[name]
        if command.commands:
            return _Group(command, name=name, help=command.summary, context_settings=_HELP, no_args_is_help=True)
        alone = typer.Typer(add_completion=False)
        function = with_copies(loaded(command.function))
        alone.command(name, cls=_Command, context_settings=_HELP)(function)
        return cast("TyperCommand", typer.main.get_command(alone))

    def __iter__(self) -> Iterator[str]:
        return iter(self._table)

    def __len__(self) -> int:
        return len(self._table)


class _Group(_Light, TyperGroup):
    """A group of commands, with help in colour: the program, or a command with subcommands."""

    def __init__(self, command: Command | None = None, **options: Any) -> None:
        super().__init__(**options)
        self.extra = command.extra if command else ""
        self.table: Mapping[str, Command] = command.commands if command else named("commands")
        self.commands = _Commands(self.table)  # type: ignore[assignment]

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ARG002
        """The names in the order of the help."""
        return list(self.table)

    def get_command(self, ctx: Any, cmd_name: str) -> TyperCommand | None:  # noqa: ARG002
        """A command as a list of commands shows it; its options are not needed for that, nor is its module."""
        command = self.table.get(cmd_name)
        return TyperCommand(name=cmd_name, help=command.summary) if command else None

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that the arguments begin with, to be run or completed."""
        if f"--{args[0]}" in _OPTIONS and args[0] not in self.table:
            ctx.fail(f"No such command {args[0]!r}. Did you mean 'livebode --{args[0]}'?")
        try:
            name, listed, rest = super().resolve_command(ctx, args)
        except typer.TyperException as error:
            if ctx.parent is None and (left_out := wings_left_out("commands")):
                wings = " or ".join(f"the wing {name}" for name in left_out)
                error.message += f" Its wing may be missing: install {wings} of livebode."
            raise
        return name, listed and self.commands[listed.name or ""], rest


app = typer.Typer(
    cls=_Group,
    help=ABOUT,
    context_settings=_HELP,
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
)


@app.callback(invoke_without_command=True)
def _version(
    context: typer.Context,
    version: bool = typer.Option(False, "--version", help="Print the version and exit.", is_eager=True),
    log_level: Level = None,
    log_file: File = None,
) -> None:
    if version:
        typer.echo(f"livebode {__version__}")
        raise typer.Exit
    context.obj = LogOptions(log_level, log_file)


def run_application() -> None:
    """Run the command line and exit with its code."""
    _prepare_process()
    try:
        try:
            code = app(standalone_mode=False)
        finally:  # writing the buffered output may fail
            sys.stdout.flush()
    except typer.Abort:
        _stop("livebode: aborted", 1)
    except typer.TyperException as error:
        _show_usage_error(error)
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        _stop("livebode: stopped; nothing was written", 130)
    except BrokenPipeError:
        # The reader of the output has closed the pipe; the command itself succeeded.
        _discard_output()
    except Exception as error:
        _fail(error)
    else:
        if code == 130:  # Ctrl-C in a command: Typer has made an exit of it
            _stop("livebode: stopped; no file is half written", code)
        sys.exit(code)


def _show_usage_error(error: typer.TyperException) -> None:
    if error.format_message():  # none where the help was printed instead
        from livebode.cli.command_help import error_page

        print_page(lambda width, colours: error_page(error, width, colours=colours), stderr=True)


def _fail(error: Exception) -> None:
    if disk_full(error):
        _discard_output()
    failure = failure_of(error)
    from livebode.records import to_json  # not every command needs what it loads

    _stop(to_json({"error": failure.error}) if json_requested() else failure.text, failure.exit_code)


def _prepare_process() -> None:
    for number in _ENDING:
        signal.signal(number, _end)
    protect()
    warnings.showwarning = _warn
    warnings.simplefilter("default", DamageWarning)
    warnings.simplefilter("default", PluginWarning)


def _warn(message: Warning | str, category: type[Warning], filename: str, lineno: int, *_: Any, **__: Any) -> None:
    """Print what is for a person; an overflow in a channel of huge values, for example, is for the log."""
    if issubclass(category, DamageWarning | PluginWarning):
        print(f"livebode: {message}", file=sys.stderr)
    else:
        logging.getLogger(__name__).warning("%s in %s, line %d: %s", category.__name__, filename, lineno, message)


def _end(number: int, _frame: object) -> None:
    # As an exception, so that partially written files are removed.
    raise SystemExit(128 + number)


def _discard_output() -> None:
    # Otherwise Python reports the error again when it flushes at exit.
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _stop(sentence: str, code: int) -> None:
    print(sentence, file=sys.stderr)
    sys.exit(code)
