"""[signals]: names of the channels."""

from __future__ import annotations

from livebode.configuration.section import ConfigurationSection


class SignalsSection(ConfigurationSection):
    """[signals]: names of the channels; in a recording also expressions, such as "-enc1" or "pos + 0.35*angle".

    Parameters
    ----------
    output
        Channel y, the response of the machine: a velocity or a position.
    input
        Channel u, the input of the plant, such as the torque or the current. Required by the estimators "direct" and
        "joint".
    excitation
        Channel w, the excitation that is added in the loop. Required by the estimators "joint" and "indirect".
    schedule
        Channel over which responses are shown, such as the position.
    ready
        Channel that shows whether the machine is ready (drive on, homed, not stopped): not zero, or see
        monitoring.ready_mask. A missing value is not ready. A response whose window contains a sample that is not
        ready is recorded and shown, but not assessed, and its alarms are suppressed. Default: always ready.
    """

    output: str
    input: str | None = None
    excitation: str | None = None
    schedule: str | None = None
    ready: str | None = None
