"""From a source to the record: what one run of livebode does."""

from livebode.session.audience import Audience
from livebode.session.axis import Axis
from livebode.session.live import run_live
from livebode.session.tracking import Draw, Outcome, run

__all__ = ["Audience", "Axis", "Draw", "Outcome", "run", "run_live"]
