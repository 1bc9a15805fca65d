"""Reports of failed commands: a sentence, or an object with --json."""

from __future__ import annotations

import errno
import sys
import traceback
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from livebode.core import LivebodeError, UsageError, not_written, plural
from livebode.dataclass import dataclass
from livebode.plugins import GROUPS, Plugin, plugins

_OPTIONS_BY_CODE = {"output.exists": ("out", "force")}
_UNITS = frozenset({"hz", "s", "days", "n", "m", "db", "deg", "rad"})
_FULL_DISK = (errno.ENOSPC, errno.EDQUOT)
_INTERNAL, _USAGE, _TEMPORARY = 1, 2, 75
"""Exit codes; the last one is EX_TEMPFAIL of sysexits.h."""


@dataclass(frozen=True)
class Failure:
    """Report of an error: text for a person, object for a program, exit code of the process."""

    text: str
    error: dict[str, Any]
    exit_code: int


def disk_full(error: Exception) -> bool:
    """Whether the error is a full disk."""
    return isinstance(error, OSError) and error.errno in _FULL_DISK


def json_requested() -> bool:
    """Whether the command line contains --json, even if it cannot be parsed."""
    return "--json" in sys.argv[1:]


def failure_of(error: Exception) -> Failure:
    """The report of the error that stopped a command."""
    known = _known(error)
    if known is None:
        lines = "".join(traceback.format_exception(error))
        plugin = _plugin_in(error)
        place = f"the plug-in {plugin.package} {plugin.version}" if plugin else "livebode"
        whom = " to its authors" if plugin else ""
        text = f"{lines}livebode: internal error in {place}; please report it{whom} with the lines above"
        return Failure(text, _internal(error, lines, whom), _INTERNAL)
    options = [option for option in known.facts.get("options", ()) if option not in str(known)]
    named = f" ({plural('option', len(options))} {', '.join(options)})" if options else ""
    return Failure(f"livebode: {known}{named}", _written(known), exit_code_of([known]))


def exit_code_of(errors: Sequence[BaseException]) -> int:
    """The exit code for the errors of several axes: internal, else what may pass, else wrong as it is."""
    if not all(isinstance(error, LivebodeError) for error in errors):
        return _INTERNAL
    return _TEMPORARY if any(getattr(error, "temporary", False) for error in errors) else _USAGE


def _written(error: LivebodeError) -> dict[str, Any]:
    return {name: _plain(value) for name, value in error.as_dict().items()}


def _plugin_in(error: Exception) -> Plugin | None:
    """The plug-in of somebody else whose code is on the way to an error; the last one if there are several."""
    frames = reversed([frame for frame, _ in traceback.walk_tb(error.__traceback__)])
    modules = [str(frame.f_globals.get("__name__")).partition(".")[0] for frame in frames]
    others = {plugin.root: plugin for group in GROUPS for plugin in plugins(group) if not plugin.is_own}
    return next((others[module] for module in modules if module in others), None)


def _internal(error: Exception, lines: str, whom: str) -> dict[str, Any]:
    return {
        "code": "internal",
        "place": "",
        "message": f"{type(error).__name__}: {error}",
        "remedy": f"please report it{whom} with the traceback",
        "facts": {"traceback": lines},
    }


def name_options(error: LivebodeError, parameters: Iterable[Any]) -> None:
    """Add the options of the command that the error's argument or key belongs to as its fact `options`."""
    known = {
        parameter.name.rstrip("_"): max(parameter.opts, key=len)
        for parameter in parameters
        if parameter.param_type_name == "option"
    }
    key = None if error.code == "config.key-unknown" else error.facts.get("key")  # no option sets it
    names = [error.facts.get("argument"), key, *_OPTIONS_BY_CODE.get(error.code, ())]
    options = [option for name in names if name and (option := _option(str(name), known))]
    if options:
        error.facts.setdefault("options", list(dict.fromkeys(options)))


def _option(name: str, known: Mapping[str, str]) -> str | None:
    parts = name.rpartition(".")[2].split("_")
    while parts[1:] and "_".join(parts) not in known and parts[-1] in _UNITS:
        parts.pop()
    return known.get("_".join(parts))


def unparsed(error: Exception, command: str | None) -> UsageError:
    """An error of Typer about the options, as an error with a code."""
    message = getattr(error, "format_message", error.__str__)()
    return UsageError("options", message.rstrip("."), f"see livebode {command} --help", command=command)


def _known(error: Exception) -> LivebodeError | None:
    if isinstance(error, LivebodeError):
        return error
    if isinstance(error, MemoryError):
        return UsageError(
            "too-large", "there is not enough memory", "take a shorter window, fewer lines or a longer hop"
        )
    if isinstance(error, OSError) and disk_full(error):
        return not_written(Path(error.filename) if isinstance(error.filename, str) else None, error, unchanged=False)
    return None


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(name): _plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, str | int | float | None):
        return value
    return _plain(value.tolist()) if hasattr(value, "tolist") else str(value)
