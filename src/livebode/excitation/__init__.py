"""Excitations: to recognise one in a recording, and to make one."""

from livebode.excitation.multisine import multisine, schroeder_phases
from livebode.excitation.recognise import Excitation, recognise

__all__ = ["Excitation", "multisine", "recognise", "schroeder_phases"]
