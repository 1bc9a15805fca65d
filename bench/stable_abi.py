"""`python -m bench.stable_abi PYTHON`: what the stable ABI costs a call of the kernel and a tracker.

PYTHON is that of an environment with livebode's dependencies for 3.12 or later (`make test-abi3` makes one). Its stable
ABI is compared with its own ABI: the same Python, the same packages. The second table compares it with the wheel of the
Python that runs this, and shows the Pythons and their packages too. Ratios are above 1 where the stable ABI is slower;
`bench.versions` has the method.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from pathlib import Path

from bench.versions import scenarios
from bench.versions.__main__ import SCRIPT, compared
from bench.versions.installed import installed, working_tree

NAMES = ("kernel, sample by sample", "kernel, hop 20", "kernel, every sample", "tracker, blocks of 100")
OWN_ABI = "wheel.py-api="


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.stable_abi", description=__doc__)
    parser.add_argument("python", type=Path, help="Python 3.12 or later, with the dependencies of livebode")
    parser.add_argument("--rounds", type=int, default=9, help="rounds of each scenario, at least")
    options = parser.parse_args()
    later = options.python.absolute()
    with tempfile.TemporaryDirectory(prefix="livebode-abi-") as scratch:
        folder = Path(scratch)
        source = working_tree(folder / "source")
        stable = installed(source, folder / "stable", later)
        own = installed(source, folder / "own", later, OWN_ABI)
        bases = {"its own ABI": own, "the wheel of this Python": installed(source, folder / "this")}
        shutil.copy2(scenarios.__file__, folder / SCRIPT)
        slower = []
        for title, base in bases.items():
            print(f"stable ABI and {title}, processor time")
            print(f"{'':32}{'base, ms':>10}{'now, ms':>10}{'ratio':>8}{'quartiles':>18}", flush=True)
            for name in NAMES:
                found = compared((base, stable), folder, name, options.rounds)
                print(found, flush=True)
                if base is own and found.verdict == "slower":
                    slower.append(name)
    print(f"stable ABI slower by more than 3 % than its own: {', '.join(slower) or 'none'}")
    raise SystemExit(1 if slower else 0)


if __name__ == "__main__":
    main()
