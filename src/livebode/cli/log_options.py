"""--log-level and --log-file, which stand before the command."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from livebode.core import LivebodeError
from livebode.dataclass import dataclass


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
    """Values of both options."""

    level: LogLevel | None = None
    file: Path | None = None


@contextmanager
def logged(command: str, module: str, options: LogOptions) -> Iterator[None]:
    """Log of a command: its beginning and end, and the error that ends it."""
    import logging  # not for the help of a command

    from livebode.cli.log_output import log_output

    # Below livebode, also the command of a plug-in: what is logged there is written.
    log = logging.getLogger("livebode").getChild(module.removeprefix("livebode."))
    with log_output(options.level, options.file):
        log.info("livebode %s begins", command)
        try:
            yield
        except LivebodeError as error:
            log.error("%s: %s", error.code, error)
            raise
        except (typer.Exit, typer.Abort, BrokenPipeError):
            raise
        except Exception as error:
            log.error("ended by %s", type(error).__name__, exc_info=error)
            raise
        finally:
            log.info("livebode %s ends", command)
