"""Limits of the machine, and the largest excitation within them."""

from __future__ import annotations

from math import inf, isnan
from typing import Annotated

from annotated_types import Gt

from livebode.core import DesignError, UsageError
from livebode.dataclass import dataclass
from livebode_design._peaks import Peak
from livebode_design.machine import MOTION_KEYS, QUANTITIES, UNITS, Machine, Quantity

_Above0 = Annotated[float, Gt(0)]


@dataclass(frozen=True, kw_only=True)
class MachineLimits:
    """Limits of motor, mechanics and drive; an omitted quantity is not limited.

    Parameters
    ----------
    torque_n_m_max
        Largest magnitude of the torque, N m.
    speed_m_per_s_max
        Largest magnitude of the speed, m/s.
    following_error_m_max
        Largest magnitude of the following error, m.
    position_m_min
        Lower end of the travel, m.
    position_m_max
        Upper end of the travel, m.

    Raises
    ------
    UsageError
        If a limit is not above 0, or the travel has no room.
    """

    torque_n_m_max: _Above0 = inf
    speed_m_per_s_max: _Above0 = inf
    following_error_m_max: _Above0 = inf
    position_m_min: float = -inf
    position_m_max: float = inf

    def __post_init__(self) -> None:
        for name in ("torque_n_m_max", "speed_m_per_s_max", "following_error_m_max"):
            if isnan(value := getattr(self, name)) or value <= 0:
                raise UsageError(
                    "out-of-range",
                    f"{name}={value} is not above 0",
                    "leave it out for no limit",
                    argument=name,
                    value=value,
                )
        if not self.position_m_min < self.position_m_max:
            raise UsageError(
                "out-of-range",
                f"position_m_min={self.position_m_min} is not below position_m_max={self.position_m_max}",
                "correct one of them",
                argument="position_m_min",
                value=self.position_m_min,
                position_m_max=self.position_m_max,
            )

    def of(self, quantity: Quantity) -> tuple[float, float]:
        """Lowest and highest permitted value."""
        if quantity == "travel":
            return self.position_m_min, self.position_m_max
        most = {
            "torque": self.torque_n_m_max,
            "speed": self.speed_m_per_s_max,
            "following error": self.following_error_m_max,
        }[quantity]
        return -most, most

    def limited(self, quantity: Quantity) -> bool:
        """Whether there is a limit at either end."""
        low, high = self.of(quantity)
        return low > -inf or high < inf


def check_known(machine: Machine, limits: MachineLimits) -> None:
    """Raise DesignError for a limited quantity whose range in the motion alone is not specified."""
    for name in QUANTITIES:
        if limits.limited(name) and not all(name in place.motion for place in machine.places):
            raise DesignError(
                "motion-unknown",
                f"the {name} is limited, but its lowest and highest value in the motion alone are not given",
                f"give them (in a file measured.{MOTION_KEYS[name]}), or leave out the limit",
                quantity=name,
                key=f"measured.{MOTION_KEYS[name]}",
            )


def room(peaks: tuple[Peak, ...], limits: MachineLimits) -> tuple[float, Peak | None]:
    """Factor on the excitation that reaches the first limit, and the peak that reaches it.

    0 or less where the motion alone leaves no room; infinite, with None, without limits.
    """
    largest, first = inf, None
    for peak in peaks:
        low, high = limits.of(peak.quantity)
        least, most = peak.own or (0.0, 0.0)
        for own, excited, limit in ((most, peak.excited[1], high), (-least, -peak.excited[0], -low)):
            if limit == inf:
                continue
            factor = (limit - own) / excited if excited > 0 else (inf if own <= limit else -inf)
            if factor < largest:
                largest, first = factor, peak
    return largest, first


def beyond(peak: Peak, limits: MachineLimits, share: float, amplitude: float | None, passing: float) -> DesignError:
    """Why a peak that leaves only this share of the excitation is rejected, and the remedy.

    `passing` is an amplitude within the limits, 0 where there is none. Without an amplitude the lines have one each,
    and it is their permitted factor.
    """
    low, high = limits.of(peak.quantity)
    unit, name = UNITS[peak.quantity], peak.quantity
    above = peak.high - high > low - peak.low
    value, limit, added = (peak.high, high, peak.excited[1]) if above else (peak.low, low, peak.excited[0])
    where = f" ({peak.place})" if peak.place else ""
    if share <= 0:
        return DesignError(
            "no-room-in-motion",
            f"the motion alone has a {name} of {value - added:.4g} {unit}{where}, which leaves no room to the limit of "
            f"{limit:.4g} {unit}",
            "change the motion, or correct the limit",
            quantity=name,
            value=value - added,
            limit=limit,
        )
    if amplitude is None:
        cause, remedy = "the amplitudes as listed give", f"multiply them by {passing:.4g} or less"
    else:
        cause, remedy = f"an amplitude of {amplitude:.4g} N m gives", f"take at most {passing:.4g} N m"
    if passing <= 0:
        remedy = "take finer steps of the drive: no smaller amplitude is possible in these"
    return DesignError(
        "limit-exceeded",
        f"{cause} a {name} of {value:.4g} {unit}{where}, beyond the limit of {limit:.4g} {unit}",
        remedy,
        argument="amplitude_n_m",
        quantity=name,
        value=value,
        limit=limit,
        passing=passing,
    )
