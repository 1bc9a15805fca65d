"""`python -m studies [name …]`: measures, draws, writes the numbers and the page, and prints the verdicts."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from studies import STUDIES
from studies.page import write_page
from studies.result import Result, Study

ROOT = Path(__file__).parents[1]
IMAGES = ROOT / "docs" / "images" / "studies"


def run(study: Study) -> None:
    began = time.perf_counter()
    result = study.measure(False)
    write(study, result, IMAGES)
    print(f"{study.title} ({time.perf_counter() - began:.0f} s)")
    for verdict in result.verdicts:
        print(f"  {verdict}")


def write(study: Study, result: Result, folder: Path) -> None:
    """The figure and the numbers."""
    folder.mkdir(parents=True, exist_ok=True)
    study.draw(result).savefig(folder / f"{study.name}.png", metadata={"Software": None})
    text = json.dumps(result.plain(), indent=1, ensure_ascii=False, default=_number)
    (folder / f"{study.name}.json").write_text(text + "\n", encoding="utf-8")


def _number(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else str(value)


def main(names: list[str]) -> int:
    known = {study.name: study for study in STUDIES}
    if unknown := [name for name in names if name not in known]:
        print(f"there is no study {unknown[0]!r}; choose from {', '.join(known)}", file=sys.stderr)
        return 2
    for name in names or known:
        run(known[name])
    write_page(STUDIES, IMAGES, ROOT / "docs" / "explanation" / "studies.md")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
