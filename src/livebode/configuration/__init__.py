"""The configuration of an axis: axis.toml, its validation, and the configuration that a run recorded."""

from livebode.configuration.axes import Axes, ConfigurationFile
from livebode.configuration.axis import Axis

__all__ = ["Axes", "Axis", "ConfigurationFile"]
