"""What a Python session uses first: a run to look at, an experiment to design, an example to try."""

from livebode.interface._examples import example_axis, example_responses, example_run
from livebode.interface._experiment import design
from livebode.interface._run import Run

__all__ = ["Run", "design", "example_axis", "example_responses", "example_run"]
