"""The bill of materials of livebode as it is installed: a CycloneDX file with every package, version and licence."""

from __future__ import annotations

import json
import subprocess
import tempfile
from pathlib import Path

from tools.wheels.interpreters import ROOT, interpreters
from tools.wheels.trial import REQUIREMENT, TOOLS


def bill(dist: Path, to: Path) -> int:
    """Install the wheels of this directory with the pinned dependencies, write the bill; return how many it has."""
    with tempfile.TemporaryDirectory() as folder:
        python = Path(folder) / "bin/python"
        subprocess.run([TOOLS / "uv", "venv", "--quiet", "--python", interpreters()[0].path, folder], check=True)
        install = [TOOLS / "uv", "pip", "install", "--quiet", "--python", python, "--find-links", dist,
                   "--refresh-package", "livebode"]  # fmt: skip
        subprocess.run([*install, "--constraints", ROOT / "requirements-dev.lock", REQUIREMENT], check=True)
        subprocess.run(
            [TOOLS / "cyclonedx-py", "environment", "--pyproject", ROOT / "pyproject.toml", "--output-reproducible",
             "--output-file", to, python],
            check=True,
        )  # fmt: skip
    return len(checked(json.loads(to.read_text("utf-8"))))


def checked(found: dict[str, object]) -> list[dict[str, object]]:
    """The components of a bill; ValueError if the bill lacks livebode, or one of them its version or licence."""
    about = found["metadata"]["component"]  # type: ignore[index]
    if about["name"] != "livebode":
        raise ValueError(f"the bill is that of {about['name']}")
    components: list[dict[str, object]] = found["components"]  # type: ignore[assignment]
    lacking = [one["name"] for one in components if not (one.get("version") and one.get("licenses"))]
    if lacking:
        raise ValueError(f"no version or licence is known of {', '.join(map(str, lacking))}")
    return components
