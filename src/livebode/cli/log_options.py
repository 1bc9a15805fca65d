"""--log-level and --log-file, before a command or behind it."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from functools import wraps
from pathlib import Path
from typing import Annotated, Any

import typer

from livebode.core import LivebodeError


class LogLevel(StrEnum):
    """From the most to the least."""

    debug = "debug"
    info = "info"
    warning = "warning"
    error = "error"


Level = Annotated[
    LogLevel | None,
    typer.Option(
        metavar="LEVEL",
        help="Write a log from this level on: debug, info, warning or error. \\[default: info with --log-file]",
    ),
]
File = Annotated[Path | None, typer.Option(metavar="FILE", help="Write the log there instead of on standard error.")]


@dataclass(frozen=True)
class LogOptions:
    """What was given before the command."""

    level: LogLevel | None = None
    file: Path | None = None


def with_log(command: Callable[..., None]) -> Callable[..., None]:
    """The command with both options; those behind it replace those before it."""

    @wraps(command)
    def logged(*, context: typer.Context, log_level: LogLevel | None, log_file: Path | None, **given: Any) -> None:
        import logging  # not for the help of a command

        from livebode.cli.log_output import log_output

        log = logging.getLogger(command.__module__)
        before: LogOptions = context.obj
        with log_output(log_level or before.level, log_file or before.file):
            log.info("livebode %s begins", context.info_name)
            try:
                command(**given)
            except LivebodeError as error:
                log.error("%s: %s", error.code, error)
                raise
            except (typer.Exit, typer.Abort, BrokenPipeError):
                raise
            except Exception as error:
                log.error("ended by %s", type(error).__name__, exc_info=error)
                raise
            finally:
                log.info("livebode %s ends", context.info_name)

    own = inspect.signature(command, eval_str=True)
    kind = inspect.Parameter.KEYWORD_ONLY
    added = [
        inspect.Parameter("log_level", kind, default=None, annotation=Level),
        inspect.Parameter("log_file", kind, default=None, annotation=File),
        inspect.Parameter("context", kind, annotation=typer.Context),
    ]
    parameters = [parameter.replace(kind=kind) for parameter in own.parameters.values()]
    signature = own.replace(parameters=[*parameters, *added])
    logged.__signature__ = signature  # type: ignore[attr-defined]
    logged.__annotations__ = {name: parameter.annotation for name, parameter in signature.parameters.items()}
    return logged
