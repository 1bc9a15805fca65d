"""`make durations`: seconds of each test of at least a tenth of one, the longest first.

The table is bench/history/test-seconds.csv. Where tests run in several processes, files begin in the
order of the sums of their tests (conftest.py).
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path
from xml.etree import ElementTree

SHORTEST_S = 0.1


def main() -> None:
    """Print the table of what pytest wrote by `--junitxml` of the family xunit1."""
    cases = ElementTree.parse(Path(sys.argv[1])).iter("testcase")
    rows = sorted(
        ((float(case.attrib["time"]), case.attrib["file"], case.attrib["name"]) for case in cases), reverse=True
    )
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(("seconds", "file", "test"))
    table.writerows((f"{seconds:.1f}", *names) for seconds, *names in rows if seconds >= SHORTEST_S)


if __name__ == "__main__":
    main()
