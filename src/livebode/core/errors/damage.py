"""A warning, not an error: the rest is read."""


class DamageWarning(UserWarning):
    """A file of a run or a lake is damaged; its damaged part is left out, and the rest is read."""
