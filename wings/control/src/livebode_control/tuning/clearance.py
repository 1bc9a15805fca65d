"""Distance of L from what a specification forbids, with its derivative."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from livebode.arrays import Complex, Floats
from livebode_control.tuning.specification import LoopSpecification

_HALF_WIDTH = 0.04  # of segment and arc, so that the curve cannot pass them between two points unseen


@dataclass(frozen=True)
class ForbiddenRegion:
    """The points of the Nyquist plane where L may not be; all contain −1.

    Attributes
    ----------
    sensitivity_radius
        1/Ms, around −1.
    disk
        Centre on the real axis and radius of the disk margin; None without one.
    gain
        The segment from −1 to −1/gain.
    phase_rad
        The arc of the unit circle around −1, to both sides.
    """

    sensitivity_radius: float
    disk: tuple[float, float] | None
    gain: float
    phase_rad: float

    @classmethod
    def of(cls, specification: LoopSpecification) -> ForbiddenRegion:
        """The region of a specification.

        |S − 1/2| < 1/α outside of the disk with diameter from −(2 + α)/(2 − α) to −(2 − α)/(2 + α) (Seiler, Packard
        and Gahinet, An introduction to disk margins, IEEE Control Systems 40(5), 2020).
        """
        alpha, disk = specification.disk_margin, None
        if alpha > 0:
            far, near = (2 + alpha) / (2 - alpha), (2 - alpha) / (2 + alpha)
            disk = -(far + near) / 2, (far - near) / 2
        gain = 10 ** (specification.gain_margin_db / 20)
        return cls(1 / specification.max_sensitivity, disk, gain, np.radians(specification.phase_margin_deg))

    def clearance(self, loop: Complex) -> tuple[Floats, Complex]:
        """Distance to the region (negative within a disk), and the unit vector that points away from it."""
        aways, radii = zip(*self._each(loop))
        away = np.stack(aways)
        size = np.maximum(np.abs(away), 1e-300)
        distance = size - np.array(radii).reshape(-1, *[1] * loop.ndim)
        nearest = np.argmin(distance, axis=0)[np.newaxis]
        return (
            np.take_along_axis(distance, nearest, 0)[0],
            np.take_along_axis(away / size, nearest, 0)[0],
        )

    def distance(self, loop: Complex) -> Floats:
        """Distance to the region, negative within a disk."""
        return np.asarray(np.min([np.abs(away) - radius for away, radius in self._each(loop)], axis=0))

    def nearest(self, point: complex) -> str:
        """The limit that a point is nearest to, for people."""
        names = ["limit of Ms", *["disk margin"] * (self.disk is not None), "gain margin", "phase margin"]
        distances = [abs(away[0]) - radius for away, radius in self._each(np.array([point]))]
        return names[int(np.argmin(distances))]

    def _each(self, loop: Complex) -> list[tuple[Complex, float]]:
        """The vector from the nearest centre, and the radius around it, for each part of the region."""
        found = [(loop + 1.0, self.sensitivity_radius)]
        if self.disk is not None:
            found.append((loop - self.disk[0], self.disk[1]))
        on_segment = np.clip(loop.real, -1.0, max(-1 / self.gain - _HALF_WIDTH, -1.0))
        found.append((loop - on_segment, _HALF_WIDTH))
        half = max(self.phase_rad - _HALF_WIDTH, 0.0)
        on_arc = -np.exp(1j * np.clip(np.angle(-loop), -half, half))
        found.append((loop - on_arc, _HALF_WIDTH))
        return found
