"""Numbers in a remedy: whoever follows it literally must not be refused again."""


def rounded_down(value: float) -> float:
    """Four digits that are not above the value, which is above 0.

    >>> rounded_down(1.23456), rounded_down(0.0019996)
    (1.234, 0.001999)
    """
    near = float(f"{value:.4g}")
    return near if near <= value else float(f"{value * (1 - 5e-4):.4g}")
