"""Responses of an axis in motion, corrected by a model that follows the axis's motion."""

from livebode.motion.correction import MotionCorrection
from livebode.motion.friction_curve import FrictionCurve, friction_curve
from livebode.motion.model import MovingModel, PositionCurve

__all__ = ["FrictionCurve", "MotionCorrection", "MovingModel", "PositionCurve", "friction_curve"]
