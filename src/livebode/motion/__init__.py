"""Responses of an axis in motion, corrected by a model that follows the axis's motion."""

from livebode.motion.angle_orders import AngleWindows, Shaft, ShaftOrders, angle_windows, shaft_orders
from livebode.motion.correction import MotionCorrection
from livebode.motion.friction_curve import FrictionCurve, friction_curve
from livebode.motion.model import MovingModel, PositionCurve

__all__ = [
    "AngleWindows",
    "FrictionCurve",
    "MotionCorrection",
    "MovingModel",
    "PositionCurve",
    "Shaft",
    "ShaftOrders",
    "angle_windows",
    "friction_curve",
    "shaft_orders",
]
