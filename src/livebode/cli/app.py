"""The command line: `livebode run`, `livebode inspect`. Exit codes: 0 done, 2 the user's mistake, 1 ours."""

from __future__ import annotations

import sys
import traceback

import click
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


@app.callback()
def _version(
    version: bool = typer.Option(False, "--version", help="Print the version and exit.", is_eager=True),
) -> None:
    if version:
        from livebode import __version__

        typer.echo(f"livebode {__version__}")
        raise typer.Exit


def main() -> None:
    """Run the command line and exit with its code."""
    sys.exit(_run())


def _run() -> int:
    try:
        code = app(standalone_mode=False)
    except InputError as error:
        return _say(f"livebode: {error}", 2)
    except click.ClickException as error:
        error.show()
        return 2
    except (KeyboardInterrupt, click.Abort):
        return _say("livebode: stopped; nothing was left", 130)
    except BrokenPipeError:
        # The reader of our output went away; what was to be done is done.
        sys.stderr.close()
        return 0
    except Exception:
        traceback.print_exc()
        return _say("livebode: this is a fault in livebode, not yours; please report it with the lines above", 1)
    return code or 0


def _say(sentence: str, code: int) -> int:
    print(sentence, file=sys.stderr)
    return code
