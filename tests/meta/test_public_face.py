"""The public face is what it says, loads lazily, and documents every argument that exists."""

from __future__ import annotations

import dataclasses
import inspect
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import livebode

ROOT = Path(__file__).parents[2]


def test_every_public_name_exists_and_is_listed_once() -> None:
    assert livebode.__all__ == sorted(set(livebode.__all__), key=lambda n: (not n.isupper(), not n[0].isupper(), n))
    assert set(livebode.__all__) == {name for names in livebode._HOME.values() for name in names}
    for name in livebode.__all__:
        assert getattr(livebode, name).__doc__, name
    assert set(livebode.__all__) <= set(dir(livebode))
    with pytest.raises(AttributeError, match="'Trakcer'"):
        _ = livebode.Trakcer


def test_importing_livebode_loads_nothing_heavy() -> None:
    code = "import livebode, sys; print(sorted({'numpy', 'scipy', 'matplotlib', 'pyarrow'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("name", [n for n in livebode.__all__ if inspect.isclass(getattr(livebode, n))])
def test_every_documented_parameter_exists(name: str) -> None:
    thing = getattr(livebode, name)
    section = re.search(r"Parameters\n-+\n(.*?)(?:\n\n[A-Z][a-z]+\n-+\n|\Z)", inspect.getdoc(thing) or "", re.S)
    if section is None:
        return
    names = [name for line in re.findall(r"^(\S.*)$", section.group(1), re.M) for name in line.split(",")]
    documented = {name.strip().lstrip("*") for name in names}
    known = set(inspect.signature(thing).parameters)
    if dataclasses.is_dataclass(thing):
        known |= {field.name for field in dataclasses.fields(thing)}
    assert documented <= known, documented - known


@pytest.mark.parametrize("name", ["Settings", "Loop", "PID", "Block", "Lines", "SlidingDFT"])
def test_every_misspelt_keyword_raises(name: str) -> None:
    with pytest.raises(TypeError, match="spelt_wrong"):
        getattr(livebode, name)(spelt_wrong=1)


def test_locks_name_no_host_and_agree_with_each_other() -> None:
    pins = [_pins(ROOT / lock) for lock in ("requirements-dev.lock", "requirements-bench.lock")]
    for package in pins[0].keys() & pins[1].keys():
        assert pins[0][package] == pins[1][package], package
    wanted = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"]
    assert {re.match(r"[a-z0-9-]+", w).group() for w in wanted} <= set(pins[0])


def _pins(lock: Path) -> dict[str, set[str]]:
    """Releases of each package; several where they depend on the Python version."""
    text = lock.read_text()
    assert "://" not in text
    pins: dict[str, set[str]] = {}
    for package, release in re.findall(r"^([a-z0-9-]+)==(\S+)", text, re.M):
        pins.setdefault(package, set()).add(release)
    return pins
