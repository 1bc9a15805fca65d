"""How optional packages are installed here: livebode is on no index, so by the clone that it was installed from."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from livebode.core.errors.inputs import ExtraError

if TYPE_CHECKING:
    from packaging.requirements import Requirement


def install_command(*extras: str) -> str:
    """The command that adds these extras to the livebode that runs.

    From the clone if it is still there, otherwise the packages themselves.

    >>> install_command("pdf").startswith("pip install") or " -m pip install " in install_command("pdf")
    True
    """
    from importlib.metadata import distribution  # slow to import, and needed where something is missing only

    installed = distribution("livebode")
    pip = _pip()
    clone, editable = _clone(installed.read_text("direct_url.json"))
    if clone is None:
        return f"{pip} {' '.join(_quoted(package) for package in _packages(installed.requires or [], extras))}"
    target = _quoted(f"{clone}[{','.join(extras)}]")
    return f"{pip} --editable {target}" if editable else f"{pip} {target}"


def not_installed(message: str, package: str, extra: str, **facts: object) -> ExtraError:
    """The error of an optional package that is missing, with the command that installs it."""
    return ExtraError("not-installed", message, f"run {install_command(extra)}", package=package, extra=extra, **facts)


@contextmanager
def needing(package: str, extra: str, user: str) -> Iterator[None]:
    """Around the imports of an optional package: ExtraError where it is missing.

    Parameters
    ----------
    package
        Its name, as its makers write it; in lower case it is the name to import.
    extra
        That installs it.
    what
        Needs it: a noun in the singular, for the message.

    Raises
    ------
    ExtraError
        If the package is not installed.

    Examples
    --------
    >>> with needing("SciPy", "analysis", "a validation"):
    ...     from scipy import signal
    """
    try:
        yield
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != package.lower():
            raise
        raise not_installed(f"{user} needs {package}, which is not installed", package.lower(), extra) from None


def _pip() -> str:
    """The pip of this Python: by its path if another one is found first."""
    first, here = shutil.which("pip"), Path(sys.executable)
    if first is not None and Path(first).parent == here.parent:
        return "pip install"
    return f"{_quoted(str(here)) if ' ' in str(here) else here} -m pip install"


def _clone(direct_url: str | None) -> tuple[Path | None, bool]:
    """The directory that livebode was installed from, if it is there, and whether it is installed editable."""
    from urllib.parse import urlsplit
    from urllib.request import url2pathname  # with an HTTP client

    if direct_url is None:
        return None, False
    origin = json.loads(direct_url)
    url = urlsplit(origin.get("url", ""))
    if url.scheme != "file" or "dir_info" not in origin:
        return None, False
    folder = Path(url2pathname(url.path))
    there = (folder / "pyproject.toml").is_file()
    return (folder if there else None), bool(origin["dir_info"].get("editable"))


def packages_of(extra: str, requires: Sequence[str]) -> list[Requirement]:
    """What an extra needs beside the packages that are always needed, also by the extras that it contains.

    Parameters
    ----------
    extra
        Its name.
    requires
        Of a distribution: the lines "Requires-Dist" of its metadata.

    Examples
    --------
    >>> requires = ["a>=1", "b>=2; extra == 'plots'", "livebode[plots]; extra == 'pdf'", "c; extra == 'pdf'"]
    >>> [str(one.name) for one in packages_of("pdf", requires)]
    ['b', 'c']
    """
    packages = []
    for line in requires:
        requirement = _optional(line)
        if requirement is None or requirement.marker is None or not requirement.marker.evaluate({"extra": extra}):
            continue
        if requirement.name == "livebode":
            packages += [package for inner in sorted(requirement.extras) for package in packages_of(inner, requires)]
        else:
            packages.append(requirement)
    return packages


@cache  # each extra is looked up in all lines
def _optional(line: str) -> Requirement | None:
    """The requirement; None if it is needed without an extra too."""
    from packaging.requirements import Requirement

    requirement = Requirement(line)
    return None if requirement.marker is None or requirement.marker.evaluate({"extra": ""}) else requirement


def _packages(requires: list[str], extras: tuple[str, ...]) -> list[str]:
    packages = [
        f"{requirement.name}{requirement.specifier}" for extra in extras for requirement in packages_of(extra, requires)
    ]
    return list(dict.fromkeys(packages))


def _quoted(text: str) -> str:
    quote = '"' if sys.platform == "win32" else "'"
    return f"{quote}{text}{quote}"
