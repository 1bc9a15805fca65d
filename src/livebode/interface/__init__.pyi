from livebode.interface._examples import example_axis as example_axis
from livebode.interface._examples import example_responses as example_responses
from livebode.interface._examples import example_run as example_run
from livebode.interface._experiment import design as design
from livebode.interface._run import Run as Run
from livebode.interface.example_recordings import EXAMPLES as EXAMPLES
from livebode.interface.example_recordings import Example as Example
from livebode.interface.example_recordings import write_examples as write_examples
