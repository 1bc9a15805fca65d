"""[motion]: the correction of the axis's motion."""

from __future__ import annotations

from typing import Literal

from livebode.configuration.section import ConfigurationSection, Positive


class MotionSection(ConfigurationSection):
    """[motion]: with this section the effect of the axis's motion is removed from the responses.

    Parameters
    ----------
    radius_m
        Radius of the pulley: metres of travel per radian of the motor.
    chunk_s
        Seconds that are fitted together: one stroke. Responses are delayed by this time.
    driven_by
        The signal that drives the model. "excitation" needs the controllers in [loop].
    """

    radius_m: Positive
    chunk_s: Positive = 4.0
    driven_by: Literal["torque", "excitation"] = "torque"
