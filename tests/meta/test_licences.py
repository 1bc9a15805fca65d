"""The licences of what livebode installs: none that binds its users unless NOTICE names it."""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = {
    requirement.name: extra
    for extra, needs in PROJECT["optional-dependencies"].items()
    for requirement in map(Requirement, needs)
    if requirement.name != "livebode" and (requirement.marker is None or requirement.marker.evaluate())
}
CORE = [Requirement(need).name for need in PROJECT["dependencies"]]


def copyleft(package: str) -> bool:
    """Whether the package's metadata names a GPL, LGPL or EPL."""
    facts = metadata(package)
    # Some packages have the whole text as "License"; its first line is the name.
    first = (facts.get("License") or "").strip().splitlines()[:1]
    named = [facts.get("License-Expression") or "", *first, *facts.get_all("Classifier", [])]
    return any(re.search(r"\bA?L?GPL|\bEPL|General Public|Eclipse", text) for text in named)


@pytest.mark.parametrize("package", CORE)
def test_what_is_always_installed_has_a_permissive_licence(package: str) -> None:
    assert not copyleft(package)


@pytest.mark.parametrize(("package", "extra"), EXTRAS.items())
def test_an_extra_with_another_licence_is_named_in_the_notice(package: str, extra: str) -> None:
    named = re.search(rf"^  {extra} +{package} ", (ROOT / "NOTICE").read_text(), re.M) is not None
    assert named == copyleft(package)
