"""Responses of an axis in motion, corrected by a model that follows the axis's motion."""

from livebode.motion.angle_orders import AngleWindows, Shaft, ShaftOrders, angle_windows, shaft_orders
from livebode.motion.correction import MotionCorrection
from livebode.motion.friction_curve import FrictionCurve, friction_curve
from livebode.motion.model import MovingModel, PositionCurve
from livebode.motion.order_changes import OrderChange, order_changes
from livebode.motion.time_lines import TimeLine, time_lines

__all__ = [
    "AngleWindows",
    "FrictionCurve",
    "MotionCorrection",
    "MovingModel",
    "OrderChange",
    "PositionCurve",
    "Shaft",
    "ShaftOrders",
    "TimeLine",
    "angle_windows",
    "friction_curve",
    "order_changes",
    "shaft_orders",
    "time_lines",
]
