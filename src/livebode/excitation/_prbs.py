"""Maximal-length pseudo-random binary sequences."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.core import UsageError

ORDER_MIN, ORDER_MAX = 2, 20
# Exponents besides order and 0 of one primitive polynomial for each order. That each one is primitive is what the test
# of the autocorrelation proves: no other sequence has it.
_TAPS = {
    2: (1,), 3: (1,), 4: (1,), 5: (2,), 6: (1,), 7: (1,), 8: (4, 3, 2), 9: (4,), 10: (3,), 11: (2,), 12: (6, 4, 1),
    13: (4, 3, 1), 14: (10, 6, 1), 15: (1,), 16: (12, 3, 1), 17: (3,), 18: (7,), 19: (5, 2, 1), 20: (3,),
}  # fmt: skip


def prbs(order: int, amplitude: float = 1.0, *, rate_divider: int = 1) -> Floats:
    """One period of a maximal-length sequence of ±amplitude, shape ((2^order − 1)·rate_divider,), unit of `amplitude`.

    From a shift register of `order` bits with linear feedback. Its periodic autocorrelation over the N = 2^order − 1
    bits is exactly N at 0 and −1 elsewhere (for amplitude 1), so every line of the bits has the same power N + 1,
    except the mean, 1/N of the amplitude. Holding each bit for some ticks moves the power down: the lines are then
    those of sin(πf·h/rate)/(πf·h/rate), with zeros at multiples of rate/h.

    Raises
    ------
    UsageError
        If the order is not from 2 to 20 or the hold is below 1.

    Examples
    --------
    >>> prbs(3)
    array([ 1.,  1.,  1., -1., -1.,  1., -1.])
    """
    check_order(order)
    if rate_divider < 1:
        raise UsageError(
            "out-of-range",
            f"{rate_divider=} is below 1",
            "let a bit last at least one tick",
            argument="rate_divider",
            value=rate_divider,
            low=1,
        )
    # a(n + order) = a(n) ⊕ Σ a(n + tap)
    count = 2**order - 1
    bits = np.ones(count, dtype=np.int8)
    lags = (order, *(order - tap for tap in _TAPS[order]))
    done, shortest = order, min(lags)
    while done < count:  # as many at once as are independent of each other
        stop = min(done + shortest, count)
        bits[done:stop] = np.bitwise_xor.reduce([bits[done - lag : stop - lag] for lag in lags])
        done = stop
    return np.repeat(amplitude * (2.0 * bits - 1.0), rate_divider)


def check_order(order: int) -> None:
    """Raise UsageError for an order without a register in this module."""
    if isinstance(order, bool) or not isinstance(order, (int, np.integer)) or not ORDER_MIN <= order <= ORDER_MAX:
        number = float(order) if isinstance(order, (int, float)) else ORDER_MIN
        near = int(np.clip(np.nan_to_num(np.floor(number)), ORDER_MIN, ORDER_MAX))
        raise UsageError(
            "out-of-range",
            f"the {order=} of a PRBS is not a whole number from {ORDER_MIN} to {ORDER_MAX}",
            f"take {near}, the nearest, with a period of {2**near - 1} bits",
            argument="order",
            value=order,
            nearest=near,
            low=ORDER_MIN,
            high=ORDER_MAX,
        )
