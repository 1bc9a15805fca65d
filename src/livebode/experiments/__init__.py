"""Experiments: from a description to the excitation, the axis.toml and the function blocks that play it."""
