"""Draws docs/images/plots.png: the three kinds of plot of the example's responses.

python examples/plots_picture.py
"""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt

import livebode

IMAGE = Path(__file__).parents[1] / "docs" / "images" / "plots.png"


def main() -> None:
    response = livebode.example_responses()[-1]
    figure = plt.figure(figsize=(13.0, 5.4), layout="constrained")
    grid = figure.add_gridspec(2, 3, height_ratios=[3, 2])
    magnitude = figure.add_subplot(grid[0, 0])
    phase = figure.add_subplot(grid[1, 0], sharex=magnitude)
    nyquist, nichols = (figure.add_subplot(grid[:, column]) for column in (1, 2))
    response.plot("bode", axes=(magnitude, phase))
    response.plot("nyquist", axes=nyquist)
    response.plot("nichols", axes=nichols)
    magnitude.legend(fontsize="small")
    figure.savefig(IMAGE, dpi=80, metadata={"Software": None})


if __name__ == "__main__":
    main()
