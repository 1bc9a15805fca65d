"""Draws pictures of the dashboard and of the report in Chromium, which must be installed.

python -m examples.screenshots [--out DIR] [NAME …]
"""

from __future__ import annotations

import argparse
import io
import tempfile
from pathlib import Path

from PIL import Image

from examples.screenshots.scenes import SCENES
from examples.screenshots.studio import Studio

COLOURS = 256


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m examples.screenshots", description="Screenshots as PNG files.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"default: all of {', '.join(SCENES)}")
    parser.add_argument("--out", type=Path, default=Path("build/screenshots"), help="directory [default: %(default)s]")
    given = parser.parse_args()
    if unknown := set(given.names) - set(SCENES):
        parser.error(f"no picture is named {', '.join(sorted(unknown))}; there are {', '.join(SCENES)}")
    given.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, Studio(Path(folder)) as studio:
        for name in given.names or SCENES:
            with Image.open(io.BytesIO(SCENES[name](studio))) as drawn:
                # Without a second pass over the palette the lamp of few pixels would lose its colour.
                small = drawn.convert("RGB").quantize(
                    COLOURS, method=Image.Quantize.MEDIANCUT, kmeans=1, dither=Image.Dither.NONE
                )
                small.save(given.out / f"{name}.png", optimize=True)
            print(given.out / f"{name}.png", flush=True)


if __name__ == "__main__":
    main()
