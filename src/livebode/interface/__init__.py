"""What a Python session uses first: a run to look at, an experiment to design, an example to try."""

from livebode.interface.examples import example_axis, example_responses, example_run
from livebode.interface.experiment import design
from livebode.interface.run import Run

__all__ = ["Run", "design", "example_axis", "example_responses", "example_run"]
