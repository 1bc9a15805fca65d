"""`python -m tools.release check`, and `prepare VERSION`: what must be true before a version is published.

`check` prints every check as ok or missed with its remedy; the exit code is 1 if one is missed. `prepare` sets the
version in pyproject.toml, the package and CITATION.cff, and dates the Unreleased part of CHANGELOG.md.
"""

from __future__ import annotations

import argparse
import datetime
from collections.abc import Iterable
from pathlib import Path

from tools.release.builds import BUILDS
from tools.release.checks import CHECKS, Check
from tools.release.deployment import DEPLOYMENT
from tools.release.prepare import prepare

ROOT = Path(__file__).parents[2]


def run(checks: Iterable[Check], root: Path) -> list[str]:
    """Print each check; return the names of those that are missed."""
    missed = []
    for check in checks:
        try:
            fault = check.fault(root)
        except (OSError, LookupError, ValueError) as error:
            fault = f"the check failed: {error}"
        print(f"{check.name:24}{'missed  ' + fault if fault else 'ok'}", flush=True)
        if fault:
            print(f"{'':24}→ {check.remedy}", flush=True)
            missed.append(check.name)
    return missed


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tools.release", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("check", help="print what is missing for a release")
    next_version = commands.add_parser("prepare", help="set version and date")
    next_version.add_argument("version")
    options = parser.parse_args()
    if options.command == "prepare":
        try:
            written = prepare(ROOT, options.version, datetime.datetime.now(datetime.UTC).date().isoformat())
        except ValueError as error:
            parser.error(str(error))
        print(f"written: {', '.join(written)}; install again, or `livebode --version` is the previous one")
        return
    missed = run((*CHECKS, *DEPLOYMENT, *BUILDS), ROOT)
    print(f"{len(missed)} checks missed" if missed else "every check is ok")
    raise SystemExit(1 if missed else 0)


if __name__ == "__main__":
    main()
