"""IEC 61131-3 Structured Text: the excitation, the sliding DFT and the ring that livebode reads, as function blocks."""

from livebode.structured_text.multisine import PERIOD_MAX, SMALLEST, multisine
from livebode.structured_text.names import as_name, check_name
from livebode.structured_text.project import Project, check_signals
from livebode.structured_text.ring import ring_block, ring_type
from livebode.structured_text.sliding_dft import sliding_dft
from livebode.structured_text.text import check_rate
from livebode.structured_text.twincat import twincat

__all__ = [
    "PERIOD_MAX",
    "SMALLEST",
    "Project",
    "as_name",
    "check_name",
    "check_rate",
    "check_signals",
    "multisine",
    "ring_block",
    "ring_type",
    "sliding_dft",
    "twincat",
]
