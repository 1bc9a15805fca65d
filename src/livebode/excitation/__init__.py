"""Excitations: detection in a recording, and generation."""

from livebode.excitation.chirp import chirp, chirp_lines
from livebode.excitation.low_crest import crest_between_samples, low_crest_phases
from livebode.excitation.multisine import Phases, multisine, schroeder_phases
from livebode.excitation.odd import check_band, odd_bins, odd_lines
from livebode.excitation.pattern import pattern
from livebode.excitation.prbs import check_order, prbs
from livebode.excitation.quantised import quantised
from livebode.excitation.recognise import Excitation, lines_of_window, recognise
from livebode.excitation.shaped import equal_snr
from livebode.excitation.slips import Slip, find_slips
from livebode.excitation.stepped import stepped_lines, stepped_sine

__all__ = [
    "Excitation",
    "Phases",
    "Slip",
    "check_band",
    "check_order",
    "chirp",
    "chirp_lines",
    "crest_between_samples",
    "equal_snr",
    "find_slips",
    "lines_of_window",
    "low_crest_phases",
    "multisine",
    "odd_bins",
    "odd_lines",
    "pattern",
    "prbs",
    "quantised",
    "recognise",
    "schroeder_phases",
    "stepped_lines",
    "stepped_sine",
]
