"""Checks of what others install and run: workflow, image and bill of materials, by the tools of `make wheels`."""

from __future__ import annotations

import subprocess
from pathlib import Path

from tools.release.checks import Check

TOOLS = ".venv-wheels/bin"


def _failure(root: Path, tool: str, *arguments: str | Path) -> str:
    done = subprocess.run([root / TOOLS / tool, *arguments], cwd=root, capture_output=True, text=True)
    return (done.stdout + done.stderr).strip()[-500:] if done.returncode else ""


def workflows(root: Path) -> str:
    found = sorted((root / ".github/workflows").glob("*.yml"))
    schema = _failure(root, "check-jsonschema", "--builtin-schema", "vendor.github-workflows", *found)
    return schema or _failure(root, "zizmor", "--offline", "--pedantic", ".github")


def container(root: Path) -> str:
    return _failure(root, "hadolint", "examples/deploy/Containerfile")


def bill(root: Path) -> str:
    if not list((root / "dist").glob("livebode-*.whl")):
        return "dist/ has no wheel"
    return _failure(root, "python", "-m", "tools.wheels", "bill")


DEPLOYMENT = (
    Check("workflows", workflows, "correct .github/workflows"),
    Check("container file", container, "correct examples/deploy/Containerfile"),
    Check("bill of materials", bill, "make wheels; a package without a licence needs a decision"),
)
