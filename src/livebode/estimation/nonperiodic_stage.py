"""From windows of samples to frequency responses with bounds, for an excitation that does not repeat."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import Channel, Responses, Stage, StatefulBase
from livebode.dataclass import dataclass
from livebode.estimation.line_stage import response_unit
from livebode.estimation.quantities import from_plant
from livebode.estimation.quotient import LocalPolynomial, Quotient, WelchAverage
from livebode.estimation.spectra import after
from livebode.estimation.tracker_settings import Settings

_EXCITED = 1e-12  # of the largest power so far, as for a LineStage
# The input must respond to the excitation significantly. Where it contains only noise that came around the loop, the
# quotient is that of the feedback, −1/F, with a small residual.
_CHANCE = 1e-4
# Variance of a gain relative to that of one bin: 0.1 usually. A reference that is as smooth over frequency as the
# transient, as at the ends of a chirp, cannot be told from it, and the error of the parabolas grows as the variance.
_INFLATED_MAX = 100.0


@dataclass(frozen=True, eq=False)
class Row:
    """One response: its newest sample; time, schedule and first sample (3,); and the values of its lines (lines,)."""

    sample: int
    moment: Floats
    dof: float
    lines: dict[str, NDArray[Any]]


class NonPeriodicStage(StatefulBase):
    """Responses of windows of samples, each alone or added to those before it.

    Parameters
    ----------
    settings
        Lines, signals, estimator and options.
    """

    _stage = Stage("nonperiodic-stage", 1)
    _STATE = ("_quotients", "_moments", "_weights", "_largest", "_power", "_windows")

    def __init__(self, settings: Settings) -> None:
        lines, method = settings.lines, settings.method
        self._settings = settings
        order = dict.fromkeys((method.reference, "output", method.denominator))
        self._order = [settings.roles.index(role) for role in order]  # the reference first
        self._divided = len(order) == 3  # by the response of the input
        self._differenced = np.array(settings.differenced_roles)[self._order]
        advanced = np.array(settings.advanced_ticks)[self._order]
        self._after = after(np.asarray(lines.bins), lines.window, self._differenced, advanced)
        places = -(-settings.span // settings.step) if settings.average else 0
        kind = LocalPolynomial if settings.estimator == "lpm" else WelchAverage
        self._quotients = kind(lines, len(order) - 1, places, settings.forgetting)
        self._moments, self._weights = np.zeros((places, 3)), np.zeros(places)
        self._largest, self._windows, self._power = 0.0, 0, np.zeros(len(lines))

    def found(self) -> dict[str, Any]:
        """The basis of the responses as plain data for a record: rate, window, lines, hop, the noise's origin."""
        lines, settings = self._settings.lines, self._settings
        return {
            "rate_hz": lines.rate_hz,
            "window": lines.window,
            "span": settings.span,
            "frequency_hz": lines.frequency_hz.tolist(),
            "bins": list(lines.bins),
            "quiet_bins": list(lines.quiet),
            "hop": settings.step,
            **({"forgetting": settings.forgetting} if settings.average else {}),
            "judged": {"noise": "bins" if settings.estimator == "lpm" else "windows"},
        }

    def excitation_power(self) -> Floats:
        """Mean |R|² of the reference around each line over all windows, shape (lines,); NaN before the first."""
        return self._power if self._windows else np.full(self._power.size, np.nan)

    def repeatability(self) -> Floats:
        """NaN, shape (lines,): the excitation need not repeat."""
        return np.full(self._power.size, np.nan)

    def process(self, samples: Floats | None, hops: int, sample: int, moment: Floats) -> Row:
        """The response of a window, or of it and those before it at its place.

        Parameters
        ----------
        samples
            The window in the order of the settings' roles, shape (signals, span); None where it is not complete.
        hops
            Number of the window since the last start.
        sample
            Number of its newest sample.
        moment
            Time and schedule at its centre, and the number of its first sample.
        """
        if samples is None:
            return Row(sample, moment, np.nan, self._nothing())
        signals = samples[self._order]
        if self._differenced.any():
            # The first difference is missing: like the transient, the pulse that this makes is no part of the response.
            differences = np.diff(signals, prepend=signals[:, :1])
            signals = np.where(self._differenced[:, np.newaxis], differences, signals)
        place = 0
        if len(self._weights):
            place = hops % len(self._weights)
            self._weights[place] = self._settings.forgetting * self._weights[place] + 1
            self._moments[place, :2] += (moment[:2] - self._moments[place, :2]) / self._weights[place]
            self._moments[place, 2] = moment[2] if self._weights[place] == 1 else self._moments[place, 2]
            moment = self._moments[place].copy()
        with np.errstate(all="ignore"):  # a line that cannot be determined becomes NaN
            quotient = self._quotients.process(signals, place)
            return Row(sample, moment, quotient.dof, self._at_lines(quotient))

    def _nothing(self) -> dict[str, NDArray[Any]]:
        unknown, nothing = np.full(self._power.size, np.nan), np.full(self._power.size, complex(np.nan, np.nan))
        valid = np.zeros(self._power.size, dtype=np.bool_)
        return {"value": nothing, "weight": nothing, "valid": valid} | dict.fromkeys(
            ("sigma", "coherence", "input_coherence"), unknown
        )

    def _at_lines(self, quotient: Quotient) -> dict[str, NDArray[Any]]:
        self._windows += 1
        self._power = self._power + (quotient.power - self._power) / self._windows
        self._largest = max(self._largest, float(quotient.power.max()))
        gains: Complex = quotient.gains * self._after[1:][: len(quotient.gains)] / self._after[0]
        divisor = np.asarray(gains[1] if self._divided else np.ones_like(gains[0]), dtype=np.complex128)
        plant = gains[0] / divisor
        # The error of the quotient is the part of y − G·u that follows the reference.
        unexplained = self._after[1:][: len(gains)].copy()
        unexplained[1:] *= -plant
        sigma = np.sqrt(quotient.noise(unexplained) * quotient.variance) / np.abs(divisor * self._after[0])
        valid = (
            separable(quotient) & np.isfinite(sigma) & np.isfinite(plant) & (quotient.power > _EXCITED * self._largest)
        )
        coherence = _coherence(quotient, 0)
        input_coherence = np.full(plant.size, np.nan)
        weight = quotient.power.astype(np.complex128)
        if self._divided:
            valid &= _significant(quotient, 1)
            input_coherence, weight = _coherence(quotient, 1), divisor * quotient.power
        value, derivative, weight = self._quantity(plant, gains[0], divisor, weight)
        nothing = complex(np.nan, np.nan)
        return {
            "value": np.where(valid, value, nothing),
            "weight": np.where(valid, weight, nothing),
            "valid": valid,
            "sigma": np.where(valid, sigma * np.abs(derivative), np.nan),
            "coherence": np.where(valid, coherence, np.nan),
            "input_coherence": np.where(valid, input_coherence, np.nan),
        }

    def _quantity(
        self, plant: Complex, output: Complex, input_: Complex, weight: Complex
    ) -> tuple[Complex, Complex, Complex]:
        """The quantity, its derivative by the plant, and the weight."""
        s = self._settings
        if s.quantity == "plant":
            return plant, np.ones_like(plant), weight
        signals = output, input_, np.ones_like(plant)
        value, derivative = from_plant(s.quantity, plant, s.loop, signals, s.lines.frequency_hz)
        return value, derivative, np.full_like(plant, complex(np.nan, np.nan))

    def responses(self, rows: Sequence[Row], channels: Sequence[Channel]) -> Responses:
        """The rows as Responses of these channels."""
        moments = np.array([row.moment for row in rows]).reshape(-1, 3)
        return Responses(
            lines=self._settings.lines,
            dof=np.array([row.dof for row in rows], dtype=np.float64),
            first=moments[:, 2].astype(np.int64),
            sample=np.array([row.sample for row in rows], dtype=np.int64),
            time_s=moments[:, 0],
            schedule=moments[:, 1],
            quantity=self._settings.quantity,
            unit=response_unit(channels, self._settings),
            **self._columns([row.lines for row in rows]),
        )

    def _columns(self, rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        """What a row has at each line, as arrays of shape (rows, lines)."""
        return {
            name: np.array([row[name] for row in rows], dtype=nothing.dtype).reshape(-1, nothing.size)
            for name, nothing in self._nothing().items()
        }


def separable(quotient: Quotient) -> NDArray[np.bool_]:
    """Lines at which the response can be told from what the samples before the window cause."""
    return np.asarray((quotient.variance * quotient.power < _INFLATED_MAX) & np.isfinite(quotient.gains).all(axis=0))


def _coherence(quotient: Quotient, signal: int) -> Floats:
    """Share of the power of a signal that the reference explains, shape (lines,)."""
    explained = np.abs(quotient.gains[signal]) ** 2 * quotient.power
    return np.asarray(explained / (explained + quotient.noise(_only(quotient, signal))))


def _significant(quotient: Quotient, signal: int) -> NDArray[np.bool_]:
    """Where a signal responds to the reference: F(2, 2·dof) of its gain, at 1e-4."""
    limit = quotient.dof * (_CHANCE ** (-1 / quotient.dof) - 1)
    noise = quotient.noise(_only(quotient, signal)) * quotient.variance
    return np.asarray(np.abs(quotient.gains[signal]) ** 2 > limit * noise)


def _only(quotient: Quotient, signal: int) -> Complex:
    weights = np.zeros_like(quotient.gains)
    weights[signal] = 1
    return weights
