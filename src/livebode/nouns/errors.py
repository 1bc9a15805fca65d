"""The two ways in which livebode says no."""


class InputError(ValueError):
    """What the user gave cannot be used; the message names the value and the remedy in one sentence."""


class GridError(InputError):
    """A frequency is not a line of the grid, or two things on different grids were to be combined."""


class DamageWarning(UserWarning):
    """A file of a run is damaged; what it held is left out, and the rest is read."""
