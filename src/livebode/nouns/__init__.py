"""The nouns that every floor above speaks in."""

from livebode.nouns.block import Block, Channel, missing_channel
from livebode.nouns.errors import GridError, InputError
from livebode.nouns.event import Event
from livebode.nouns.lines import Lines

__all__ = ["Block", "Channel", "Event", "GridError", "InputError", "Lines", "missing_channel"]
