"""Simulated tooth-belt axis with known truth (Nevaranta 2016)."""

from livebode.simulation.closed_loop import ClosedLoop
from livebode.simulation.configuration import BeltAxis
from livebode.simulation.corexy import CoreXY, CoreXYLoop
from livebode.simulation.extremes import extremes
from livebode.simulation.faults import Backlash, DampingGrowth, Fault, FrictionChange, LoadChange, SoftSpot, TensionLoss
from livebode.simulation.fmu import FmuAxis
from livebode.simulation.gantry import Gantry, GantryLoop
from livebode.simulation.linear import BeltResponse, Sampled, StateSpace, linear
from livebode.simulation.mechanics import Mechanics, Spans
from livebode.simulation.mechanism import LinearMechanism
from livebode.simulation.modal import ModalLoop, ModalMachine
from livebode.simulation.motion import Motion, Standstill, Strokes, StrokeSequence
from livebode.simulation.motor_loop import MotorLoop
from livebode.simulation.settings import Drive, Friction, Limits, Sensor
from livebode.simulation.source import SimulatedAxis
from livebode.simulation.truth import Truth
from livebode.simulation.two_mass_loop import TwoMassLoop, TwoMassPlant

__all__ = [
    "Backlash",
    "BeltAxis",
    "BeltResponse",
    "ClosedLoop",
    "CoreXY",
    "CoreXYLoop",
    "DampingGrowth",
    "Drive",
    "Fault",
    "FmuAxis",
    "Friction",
    "FrictionChange",
    "Gantry",
    "GantryLoop",
    "Limits",
    "LinearMechanism",
    "LoadChange",
    "Mechanics",
    "ModalLoop",
    "ModalMachine",
    "Motion",
    "MotorLoop",
    "Sampled",
    "Sensor",
    "SimulatedAxis",
    "SoftSpot",
    "Spans",
    "Standstill",
    "StateSpace",
    "StrokeSequence",
    "Strokes",
    "TensionLoss",
    "Truth",
    "TwoMassLoop",
    "TwoMassPlant",
    "extremes",
    "linear",
]
