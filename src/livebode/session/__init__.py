"""From a source to the record: what one run of livebode does."""

from livebode.session.axis import Axis
from livebode.session.inspection import Inspection, inspect
from livebode.session.run import Outcome, run

__all__ = ["Axis", "Inspection", "Outcome", "inspect", "run"]
