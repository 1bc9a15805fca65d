"""Orders of a shaft compared with those of an earlier recording."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from livebode.core import UsageError, widened
from livebode.dataclass import dataclass
from livebode_control.strokes.shaft_orders import ShaftOrders

FALSE_ALARM = 1e-3
"""Probability that any order of any shaft is reported as changed by chance."""


@dataclass(frozen=True)
class OrderChange:
    """One order, before and after.

    Attributes
    ----------
    shaft, order
        Name of the shaft, and cycles in one turn of it.
    before, after
        Complex amplitudes.
    before_bound, after_bound
        Radius around each that covers the true one with 95 %.
    difference, difference_bound
        |after − before|, or the difference of the amplitudes where the phases cannot be compared; and its bound (95 %).
    changed
        Whether the difference is not by chance.
    """

    shaft: str
    order: int
    before: complex
    after: complex
    before_bound: float
    after_bound: float
    difference: float
    difference_bound: float
    changed: bool

    def sentence(self, unit: str) -> str:
        """What changed, with bounds of 95 %."""
        unit = f" {unit}" if unit else ""
        before, after = (
            f"{abs(value):.3g} ± {bound:.2g}{unit} at {np.degrees(np.angle(value)):.0f}°"
            for value, bound in ((self.before, self.before_bound), (self.after, self.after_bound))
        )
        return f"order {self.order} of the {self.shaft} changed: {before} before, {after} now"

    def plain(self) -> dict[str, Any]:
        """Plain data for JSON; bounds of 95 %."""
        return {
            "shaft": self.shaft,
            "order": self.order,
            "changed": self.changed,
            "before": {
                "amplitude": abs(self.before),
                "phase_deg": float(np.degrees(np.angle(self.before))),
                "bound": self.before_bound,
            },
            "after": {
                "amplitude": abs(self.after),
                "phase_deg": float(np.degrees(np.angle(self.after))),
                "bound": self.after_bound,
            },
            "difference": self.difference,
            "difference_bound": self.difference_bound,
        }


def order_changes(
    before: Sequence[ShaftOrders],
    after: Sequence[ShaftOrders],
    *,
    phases: bool = True,
    false_alarm: float = FALSE_ALARM,
) -> list[OrderChange]:
    """Every order that both recordings know, in the order of `after`.

    The difference of two complex amplitudes has the sum of their variances, with the degrees of freedom of
    Satterthwaite (Biometrics Bulletin 2(6), 1946). An order is changed if its difference is beyond the bound that
    covers all orders of all shafts at once (Bonferroni).

    Parameters
    ----------
    before, after
        Orders of the same shafts.
    phases
        Whether both angles have the same zero. Else only the amplitudes are compared, by the same bound: their
        difference is never larger than that of the complex values, so that false alarms are rarer.
    false_alarm
        Probability that any order is found to be changed by chance.

    Raises
    ------
    UsageError
        If the recordings have no known order in common.
    """
    old, new = _known(before), _known(after)
    both = [key for key in new if key in old]
    if not both:
        raise UsageError(
            "conflict",
            "the two recordings have no known order in common",
            "record strokes with the same shafts at similar speeds",
            argument="baseline",
        )
    rows = np.array([[old[key], new[key]] for key in both]).T  # (columns, before and after, orders)
    value, variance, dof, bound = rows[0], rows[1].real ** 2, rows[2].real, rows[3].real
    total = variance.sum(axis=0)
    sigma, joint = np.sqrt(total), total**2 / np.sum(variance**2 / dof, axis=0)
    difference = np.abs(np.diff(value if phases else np.abs(value), axis=0)[0])
    single, all_at_once = (widened(sigma, joint, float(np.sqrt(np.log(k)))) for k in (20.0, len(both) / false_alarm))
    return [
        OrderChange(*key, complex(value[0, i]), complex(value[1, i]), float(bound[0, i]), float(bound[1, i]),
                    float(difference[i]), float(single[i]), bool(difference[i] > all_at_once[i]))
        for i, key in enumerate(both)
    ]  # fmt: skip


def _known(shafts: Sequence[ShaftOrders]) -> dict[tuple[str, int], tuple[complex, float, float, float]]:
    """Value, sigma, degrees of freedom and bound (95 %) of the known orders, by shaft and order."""
    return {
        (orders.shaft.name, order): row
        for orders in shafts
        for order, row in zip(orders.shaft.orders, zip(orders.value, orders.sigma, orders.dof, orders.bound()))
        if np.isfinite(row[1])
    }
