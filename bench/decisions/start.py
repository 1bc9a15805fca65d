"""What the start of a command costs with Matplotlib, pydantic and the standard dataclass, and without (docs/decisions).

`python -m bench.decisions.start`: processor time of new processes beyond a common part, the least of several.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

from bench.processes import Processes

ROUNDS = 9
RESPONSES = """
from livebode import example_responses
from livebode.pictures.bode import bode_figure
from livebode.pictures.vector import save_svg
responses = example_responses()
"""
AXIS = """
from livebode.configuration import Axis
data = {
    "source": {"url": "tcp://127.0.0.1:5000"},
    "signals": {"excitation": "w", "input": "u", "output": "y"},
    "tracking": {"estimator": "direct"},
}
"""
CLASSES = """
from {} import dataclass
for number in range(170):
    @dataclass(frozen=True)
    class Mark:
        x: int
        y: float
        name: str = ""
        width: int = 1
"""
CASES = (
    ("a Bode plot as SVG", RESPONSES, {
        "livebode.pictures": "save_svg(bode_figure(responses), Path('own.svg'))",
        "Matplotlib": "responses.plot(); import matplotlib.pyplot; matplotlib.pyplot.savefig('other.svg')",
    }),
    ("a configuration", AXIS, {
        "accepted without pydantic": "Axis.model_validate(data)",
        "by pydantic": "from livebode.core.typed_table_model import validated; validated(Axis, data)",
    }),
    ("170 dataclasses of four fields", "", {
        "livebode.dataclass": CLASSES.format("livebode.dataclass"), "dataclasses": CLASSES.format("dataclasses"),
    }),
)  # fmt: skip


def main() -> None:
    """Print the costs."""
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        processes = Processes(Path(folder))

        def least_s(code: str) -> float:
            return processes.least(ROUNDS, sys.executable, "-c", f"from pathlib import Path\n{code}").processor_s

        print("| what | with | ms |\n|---|---|---|")
        for what, common, ways in CASES:
            before_s = least_s(common)
            for name, code in ways.items():
                print(f"| {what} | {name} | {1000 * (least_s(common + chr(10) + code) - before_s):.0f} |")


if __name__ == "__main__":
    main()
