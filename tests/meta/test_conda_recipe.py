"""The recipe for conda-forge requires what pyproject.toml requires."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import jinja2
import yaml

ROOT = Path(__file__).parents[2]
NAMES = {"matplotlib": "matplotlib-base"}


def recipe() -> dict[str, Any]:
    template = jinja2.Template((ROOT / "examples/deploy/conda/meta.yaml").read_text("utf-8"))
    text = template.render(compiler="{}_compiler".format, stdlib="{}_stdlib".format, PYTHON="python")
    return yaml.safe_load(text)


def test_the_recipe_for_conda_has_the_version_the_requirements_and_the_licences_of_the_project() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    project, found = settings["project"], recipe()
    assert found["package"] == {"name": project["name"], "version": project["version"]}
    required = {
        requirement.partition(">=")[0]: requirement.partition(";")[0] for requirement in project["dependencies"]
    }
    wanted = {NAMES.get(name, name) + " >=" + text.partition(">=")[2] for name, text in required.items()}
    assert set(found["requirements"]["run"]) == wanted | {"python"}
    build = {requirement.replace(">=", " >=") for requirement in settings["build-system"]["requires"]}
    assert build < set(found["requirements"]["host"])
    assert all((ROOT / name).is_file() for name in found["about"]["license_file"])
