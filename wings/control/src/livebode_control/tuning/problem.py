"""The limits of a loop as functions of the parameters of its controller, with derivatives."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from livebode.analysis import stable
from livebode.arrays import Complex, Floats
from livebode.dataclass import dataclass
from livebode_control.tuning.plant_band import PlantBand
from livebode_control.tuning.predicted import gain_margin_db, phase_margin_deg
from livebode_control.tuning.specification import LoopSpecification
from livebode_control.tuning.structure import FeedbackStructure

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
        distances = [(loop + 1.0, self.sensitivity_radius)]
        if self.disk is not None:
            distances.append((loop - self.disk[0], self.disk[1]))
        on_segment = np.clip(loop.real, -1.0, max(-1 / self.gain - _HALF_WIDTH, -1.0))
        distances.append((loop - on_segment, _HALF_WIDTH))
        half = max(self.phase_rad - _HALF_WIDTH, 0.0)
        on_arc = -np.exp(1j * np.clip(np.angle(-loop), -half, half))
        distances.append((loop - on_arc, _HALF_WIDTH))
        return distances


_HALF_POWER = 0.708  # −3 dB
_ROUNDING = 1e-3  # dB and degrees


@dataclass(frozen=True, eq=False)
class TuningProblem:
    """The constraints of a structure around a plant. A limit is kept where its value is not negative.

    The disc of L at a frequency has the radius |F|·radius; it keeps clear of the forbidden region if its centre is
    farther away than that. The curve of the measured plant stays with its discs on one side of −1, so the number of
    encirclements is that of every plant within the discs (the homotopy of Karimi and Kammer, Automatica 85, 2017).
    """

    structure: FeedbackStructure
    plant: PlantBand
    specification: LoopSpecification

    @cached_property
    def region(self) -> ForbiddenRegion:
        return ForbiddenRegion.of(self.specification)

    @cached_property
    def _limit_above(self) -> float:
        """Largest |L| above the highest line: below it, no phase violates a limit."""
        near = 1.0 if self.region.disk is None else -(self.region.disk[0] + self.region.disk[1])
        return min(1 - self.region.sensitivity_radius, 1 / self.region.gain, near)

    def clearances(self, x: Floats) -> Floats:
        """Clearance less radius, shape (places, frequencies).

        It is divided by the size 1 + |L|, so that points far from −1 do not dominate.
        """
        return self._values(self.structure.response(x)[0])

    def _values(self, behind: Complex) -> Floats:
        loop = self.plant.value * behind
        value = self._values_of(loop, np.abs(behind) * self.plant.radius, self.region.distance(loop))
        return np.asarray(value / (1 + np.abs(loop)))

    def _values_of(self, loop: Complex, radius: Floats, distance: Floats) -> Floats:
        """Clearance less radius; above the highest line, what |L| is below its limit there."""
        return np.where(self.plant.above, self._limit_above - self.plant.rise * np.abs(loop), distance - radius)

    def sloped_clearances(self, x: Floats) -> tuple[Floats, Floats]:
        """The clearances and their derivatives, shape (places, frequencies) and (places, frequencies, parameters)."""
        f, slopes = self.structure.response(x)
        loop = self.plant.value * f
        radius = np.abs(f) * self.plant.radius
        distance, away = self.region.clearance(loop)
        value, scale = self._values_of(loop, radius, distance), 1 + np.abs(loop)
        part = slopes[:, np.newaxis]
        along = np.real(np.conj(away) * loop * part) - radius * part.real
        derivative = np.where(self.plant.above, -self.plant.rise * np.abs(loop) * part.real, along) / scale
        derivative -= value / scale**2 * np.abs(loop) * part.real
        return value / scale, np.moveaxis(derivative, 0, -1)

    def only(self, columns: NDArray[np.bool_]) -> TuningProblem:
        """This problem at some frequencies: for clearances, which need no neighbours."""
        plant = self.plant.only(columns)
        return replace(self, structure=self.structure.only(columns), plant=plant)

    def noise_gain(self, x: Floats) -> tuple[float, Floats]:
        """Rms of the plant input for the noise at the output, worst place, and its logarithmic derivative.

        The noise is that of the encoder's rounding, else white with an rms of 1.
        """
        f, slopes = self.structure.response(x)
        sensitivity = 1 / (1 + self.plant.value * f)
        power = self.noise_powers(f)
        total = power.sum(axis=1)
        worst = int(np.argmax(total))
        slope = (slopes * sensitivity[worst]).real @ power[worst] / total[worst]
        return float(np.sqrt(total[worst])), slope

    def noise_powers(self, feedback: Complex) -> Floats:
        """Power of the plant input due to the noise at the output, shape (places, frequencies)."""
        return np.asarray(np.abs(feedback / (1 + self.plant.value * feedback)) ** 2 * self._noise)

    @cached_property
    def _noise(self) -> Floats:
        """Power of the noise at the output that each point of the grid stands for."""
        return noise_power(
            self.plant.frequency_hz, self.specification.encoder_step, of_position=self.structure.of_position
        )

    def tracking(self, x: Floats) -> tuple[Floats, Floats]:
        """How far |T| of the worst plant is from −3 dB up to the required bandwidth, positive above; with derivatives.

        |T| of the worst plant within a disc is at least (|L| − r)/(|1 + L| + r).
        """
        required = self.specification.bandwidth_hz
        assert required is not None
        # Beyond the frequencies of the grid, the points at its end stand for the bandwidth.
        bandwidth = np.clip(required, self.plant.frequency_hz[0], self.plant.frequency_hz[-1])
        f, slopes = self.structure.response(x)
        below = (self.plant.frequency_hz <= bandwidth) & (self.plant.frequency_hz > bandwidth / 4)
        loop, slope = self.plant.value[:, below] * f[below], slopes.T[below]
        radius = self.plant.radius[:, below] * np.abs(f[below])
        away = np.abs(1 + loop)
        value = np.abs(loop) - radius - _HALF_POWER * (away + radius)
        derivative = (np.abs(loop) - (1 + _HALF_POWER) * radius)[..., np.newaxis] * slope.real
        derivative -= _HALF_POWER * (np.conj((1 + loop) / away)[..., np.newaxis] * loop[..., np.newaxis] * slope).real
        return value.ravel(), derivative.reshape(-1, len(x))

    def _stable(self, behind: Complex) -> bool:
        """Whether the loop of the measured plant is stable at every place, by Nyquist's criterion."""
        return bool(stable(self.plant.value * behind, self.plant.frequency_hz).all())

    def _between_points(self, behind: Complex) -> bool:
        """Whether gain and phase margin are kept where the curve crosses axis and unit circle between two points."""
        inside = ~self.plant.above
        f = behind[inside]
        radius = self.plant.radius[:, inside] * np.abs(f)
        return all(
            gain_margin_db(row, r) >= self.specification.gain_margin_db - _ROUNDING
            and phase_margin_deg(row, r) >= self.specification.phase_margin_deg - _ROUNDING
            for row, r in zip(self.plant.value[:, inside] * f, radius)
        )

    def feasible(self, x: Floats, tolerance: float = 1e-6) -> bool:
        """Whether every limit is kept, and the loop is stable, for every plant within the band."""
        behind = self.structure.response(x)[0]
        if float(np.min(self._values(behind))) < -tolerance:
            return False
        if not self._stable(behind) or not self._between_points(behind):
            return False
        limit = self.specification.noise_limit
        return limit is None or self.noise_gain(x)[0] <= limit * (1 + tolerance)


def noise_power(frequency_hz: Floats, encoder_step: float | None, *, of_position: bool) -> Floats:
    """Power of the noise at the output that each point of a grid up to half the rate stands for.

    It is that of white noise of 1, or of an encoder: rounding to steps q has the variance q²/12 and is white while the
    axis moves by more than a step in a tick (Widrow and Kollár, Quantization noise, 2008); of a velocity, the
    differences times the rate count.
    """
    edges = np.concatenate([frequency_hz[:1], (frequency_hz[1:] + frequency_hz[:-1]) / 2, frequency_hz[-1:]])
    share = np.diff(edges) / frequency_hz[-1]
    if encoder_step is None:
        return np.asarray(share)
    rate_hz = 2 * frequency_hz[-1]
    differences = 2 * rate_hz * np.sin(np.pi * frequency_hz / rate_hz)
    return np.asarray(share * encoder_step**2 / 12 * (1.0 if of_position else differences**2))
