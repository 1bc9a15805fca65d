"""The command line: `livebode run`, `livebode inspect`. Exit codes: 0 done, 2 the user's mistake, 1 ours."""

from __future__ import annotations

import os
import sys
import traceback

import typer

from livebode.cli.inspect_command import inspect_command
from livebode.cli.run_command import run_command
from livebode.nouns import InputError

app = typer.Typer(
    help="The Bode plot of a machine while the machine works.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.command("run")(run_command)
app.command("inspect")(inspect_command)


@app.callback(invoke_without_command=True)
def _version(
    version: bool = typer.Option(False, "--version", help="Print the version and exit.", is_eager=True),
) -> None:
    if version:
        from livebode import __version__

        typer.echo(f"livebode {__version__}")
        raise typer.Exit


def main() -> None:
    """Run the command line and exit with its code."""
    try:
        app()
    except InputError as error:
        _stop(f"livebode: {error}", 2)
    except KeyboardInterrupt:
        _stop("livebode: stopped; nothing was left", 130)
    except BrokenPipeError:
        # Who read our output has gone; Python would complain once more when it flushes at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    except Exception:
        traceback.print_exc()
        _stop("livebode: this is a fault in livebode, not yours; please report it with the lines above", 1)


def _stop(sentence: str, code: int) -> None:
    print(sentence, file=sys.stderr)
    sys.exit(code)
