"""The command line.

Commands: measure (run, demo), look at recordings and runs (inspect, query), evaluate runs (fit, margins, validate,
learn), export, check the installation (doctor). Exit codes: 0 success, 1 internal error, 2 usage error, 3 no model
fits, 130 and above stopped by a signal.
"""

from __future__ import annotations

import os
import signal
import sys
import warnings
from collections.abc import Callable
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from livebode.cli.compare_command import compare_command
from livebode.cli.demo_command import demo_command
from livebode.cli.design_command import design_command
from livebode.cli.doctor_command import doctor_command
from livebode.cli.export_command import export_command
from livebode.cli.failures import disk_full, failure_of, json_requested, name_options, unparsed
from livebode.cli.fit_command import fit_command
from livebode.cli.inspect_command import inspect_command
from livebode.cli.learn_command import learn_command
from livebode.cli.log_options import File, Level, LogOptions, with_log
from livebode.cli.margins_command import margins_command
from livebode.cli.plc_command import plc_command
from livebode.cli.query_command import query_command
from livebode.cli.report_command import report_command
from livebode.cli.run_command import run_command
from livebode.cli.schema_command import schema_command
from livebode.cli.terminal import protect, unchecked_output
from livebode.cli.validate_command import validate_command
from livebode.cli.view_command import view_command
from livebode.core import DamageWarning, LivebodeError
from livebode.records import to_json

_ENDING = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]


class _HelpGroup(TyperGroup):
    """The group of commands, with help in colour."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Format the help; escape codes pass unchecked because the texts belong to the program."""
        with unchecked_output():
            super().format_help(ctx, formatter)


class _Command(TyperCommand):
    """One command, with help in colour and errors that name its options."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Format the help; escape codes pass unchecked because the texts belong to the program."""
        with unchecked_output():
            super().format_help(ctx, formatter)

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        """Make the context; with --json, an invalid option is an error with a code."""
        try:
            return super().make_context(info_name, args, parent, **extra)
        except typer.Exit:
            raise
        except Exception as error:
            if not json_requested() or not hasattr(error, "format_message"):
                raise
            raise unparsed(error, info_name) from None

    def invoke(self, ctx: Any) -> Any:
        """Run the command; an error names the options that it concerns."""
        try:
            return super().invoke(ctx)
        except LivebodeError as error:
            name_options(error, self.params)
            raise


app = typer.Typer(
    cls=_HelpGroup,
    help="The Bode plot of a machine while the machine works.",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
)
_COMMANDS: dict[str, Callable[..., None]] = {
    "run": run_command,
    "fit": fit_command,
    "inspect": inspect_command,
    "demo": demo_command,
    "design": design_command,
    "query": query_command,
    "export": export_command,
    "margins": margins_command,
    "validate": validate_command,
    "learn": learn_command,
    "plc": plc_command,
    "report": report_command,
    "compare": compare_command,
    "view": view_command,
    "doctor": doctor_command,
    "schema": schema_command,
}
for _name, _command in _COMMANDS.items():
    app.command(_name, cls=_Command)(with_log(_command))


@app.callback(invoke_without_command=True)
def _version(
    context: typer.Context,
    version: bool = typer.Option(False, "--version", help="Print the version and exit.", is_eager=True),
    log_level: Level = None,
    log_file: File = None,
) -> None:
    if version:
        from livebode import __version__

        typer.echo(f"livebode {__version__}")
        raise typer.Exit
    context.obj = LogOptions(log_level, log_file)


def main() -> None:
    """Run the command line and exit with its code."""
    _prepare_process()
    try:
        try:
            app()
        finally:  # app() ends by SystemExit, and writing the buffered output may fail
            sys.stdout.flush()
    except KeyboardInterrupt:
        _stop("livebode: stopped; nothing was written", 130)
    except BrokenPipeError:
        # The reader of the output has closed the pipe; the command itself succeeded.
        _discard_output()
    except Exception as error:
        _fail(error)


def _fail(error: Exception) -> None:
    if disk_full(error):
        _discard_output()
    failure = failure_of(error)
    _stop(to_json({"error": failure.error}) if json_requested() else failure.text, failure.exit_code)


def _prepare_process() -> None:
    for number in _ENDING:
        signal.signal(number, _end)
    protect()
    warnings.showwarning = _warn
    warnings.simplefilter("default", DamageWarning)


def _warn(message: Warning | str, category: type[Warning], filename: str, lineno: int, *_: Any, **__: Any) -> None:
    if issubclass(category, DamageWarning):
        print(f"livebode: {message}", file=sys.stderr)
    else:
        sys.stderr.write(warnings.formatwarning(message, category, filename, lineno))


def _end(number: int, _frame: object) -> None:
    # As an exception, so that partially written files are removed.
    raise SystemExit(128 + number)


def _discard_output() -> None:
    # Otherwise Python reports the error again when it flushes at exit.
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _stop(sentence: str, code: int) -> None:
    print(sentence, file=sys.stderr)
    sys.exit(code)
