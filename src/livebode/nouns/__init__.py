"""The nouns that every floor above speaks in."""

from livebode.nouns.block import Block, Channel, missing_channel
from livebode.nouns.controllers import PID, Cascade, PositionPD
from livebode.nouns.errors import DamageWarning, GridError, InputError
from livebode.nouns.event import Event
from livebode.nouns.lines import Lines
from livebode.nouns.loop import Loop
from livebode.nouns.model import Gain, Model, as_model
from livebode.nouns.parameters import Parameters
from livebode.nouns.response import PER_LINE, PER_RESPONSE, Quantity, Response, Responses, widened
from livebode.nouns.spectra import NOT_WHOLE, SPIKE, Spectra, SpectraLayout, rms
from livebode.nouns.wording import counted, rounded_down

__all__ = [
    "NOT_WHOLE",
    "PER_LINE",
    "PER_RESPONSE",
    "PID",
    "SPIKE",
    "Block",
    "Cascade",
    "Channel",
    "DamageWarning",
    "Event",
    "Gain",
    "GridError",
    "InputError",
    "Lines",
    "Loop",
    "Model",
    "Parameters",
    "PositionPD",
    "Quantity",
    "Response",
    "Responses",
    "Spectra",
    "SpectraLayout",
    "as_model",
    "counted",
    "missing_channel",
    "rms",
    "rounded_down",
    "widened",
]
