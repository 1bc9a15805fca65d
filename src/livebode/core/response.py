"""Response: a frequency response with its bounds, and a batch of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.core.errors import ExtraError, GridError
from livebode.core.lines import Lines
from livebode.core.rows import joined

Quantity = Literal["plant", "open loop", "closed loop", "sensitivity"]
Floats = NDArray[np.float64]


def widened(sigma: ArrayLike, dof: ArrayLike, c: float) -> Floats:
    """Radius around an estimate that holds the truth with probability 1 − exp(−c²): 63.2 % for 1, 98.2 % for 2.

    A `sigma` that was itself estimated with `dof` complex degrees of freedom makes |Ĝ − G|²/sigma² follow
    F(2, 2·dof); the factor √(d(exp(c²/d) − 1)) instead of c keeps the probability. Unknown (NaN) dof gives NaN, and
    infinite dof gives c·sigma.

    >>> float(widened(1.0, np.inf, 2.0)), round(float(widened(1.0, 3.0, 2.0)), 3)
    (2.0, 2.895)
    """
    d = np.asarray(dof, dtype=np.float64)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        factor = np.where(np.isinf(d), c, np.sqrt(d * np.expm1(c * c / d)))
    return np.asarray(sigma * factor)


@dataclass(frozen=True, eq=False)
class Response:
    """The frequency response of a machine at one moment, at Lines. Immutable.

    Shapes are (lines,). Everything that belongs together is frozen together; `value` alone means little.

    Attributes
    ----------
    lines
        Where it was measured.
    value
        Complex response, `unit`; NaN where it could not be formed.
    sigma
        Standard deviation, E|value − truth|² = sigma², unit of `value`; NaN where not yet known.
    dof
        Complex degrees of freedom behind `sigma`, one number for all lines; bounds widen by it (`bound`).
    coherence
        γ² of eq. (18) between 0 and 1; NaN where not yet known.
    valid
        False where the window holds a start, a gap, a sample that is not finite or was left out, or no excitation.
    first, sample
        Numbers of the oldest and the newest sample that went in.
    time_s
        The moment the response speaks for: the centre of its window (of the windows, weighted, where periods are
        averaged), in the source's clock. It is half a window older than `sample`.
    schedule
        The scheduling signal (position, say) at that moment; NaN without one.
    quantity, unit
        What it is the response of: plant G, open loop L, closed loop T or sensitivity S.
    input_coherence
        γ² between excitation and input, where `coherence` is that between excitation and output; NaN where not known.
    weight
        Of this response in a mean that is to be a ratio of averages: plant input over excitation in the window, U/W,
        or |U|² for the direct estimator; NaN where not known.
    distortion
        What repeats with the excitation without being a linear response (friction, backlash, steps of an encoder) may
        have done to the value, unit of `value`. It is contained in `sigma`; NaN where it cannot be measured,
        infinite at a line that is not valid because of what repeats (distortion, hum of the mains, steps of a sensor).
    """

    lines: Lines
    value: NDArray[np.complex128]
    sigma: Floats
    dof: float
    coherence: Floats
    valid: NDArray[np.bool_]
    first: int
    sample: int
    time_s: float
    schedule: float = float("nan")
    quantity: Quantity = "plant"
    unit: str = ""
    input_coherence: Floats = None  # type: ignore[assignment]
    weight: NDArray[np.complex128] = None  # type: ignore[assignment]
    distortion: Floats = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        _fill_unknown(self)

    def bound(self, c: float = 2.0) -> Floats:
        """Radius that holds the truth with probability 1 − exp(−c²), shape (lines,); see `widened`."""
        return widened(self.sigma, self.dof, c)

    @property
    def magnitude_db(self) -> Floats:
        """20·log10|value|, shape (lines,)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(20 * np.log10(np.abs(self.value)))

    @property
    def phase_deg(self) -> Floats:
        """Phase in degrees, −180 … 180, shape (lines,)."""
        return np.asarray(np.degrees(np.angle(self.value)))

    def response(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        """The measured values at lines of this Response, which makes it a Model; GridError elsewhere."""
        wanted = np.asarray(frequency_hz, dtype=np.float64)
        bins = wanted / self.lines.resolution_hz
        at = np.searchsorted(self.lines.bins, np.rint(bins)).clip(0, len(self.lines) - 1)
        known = np.abs(np.asarray(self.lines.bins)[at] - bins) < 1e-6
        if not np.all(known):
            missing = float(wanted[~known].flat[0])
            raise GridError(
                "line-off",
                f"{missing:g} Hz is not a measured line, and a measured response is not interpolated",
                "choose a measured line",
                frequency_hz=missing,
                resolution_hz=self.lines.resolution_hz,
            )
        return np.asarray(self.value[at])

    def to_control(self) -> Any:
        """python-control FrequencyResponseData of the valid lines (extra `control`)."""
        try:
            import control
        except ImportError:
            raise ExtraError(
                "not-installed",
                "python-control is not installed",
                "pip install 'livebode[control]'",
                package="control",
                extra="control",
            ) from None
        omega = 2 * np.pi * self.lines.frequency_hz[self.valid]
        # `control.bode_plot` draws no system without a name.
        return control.frd(self.value[self.valid], omega, name=self.quantity)


PER_LINE = ("value", "sigma", "coherence", "valid", "input_coherence", "weight", "distortion")
"""What a response has for each of its lines."""

PER_RESPONSE = ("dof", "first", "sample", "time_s", "schedule")
"""What it has once."""

_PER_ROW = PER_LINE + PER_RESPONSE


def _fill_unknown(of: Response | Responses) -> None:
    """NaN, in the shape of the value, for what a source of responses does not know."""
    for name in ("input_coherence", "weight", "distortion"):
        if getattr(of, name) is None:
            kind = np.complex128 if name == "weight" else np.float64
            object.__setattr__(of, name, np.full(np.shape(of.value), np.nan, dtype=kind))


@dataclass(frozen=True, eq=False)
class Responses(Sequence[Response]):
    """Responses in a row, one for each hop, kept as arrays: (rows, lines) for what a line has, (rows,) for the rest.

    Indexing gives a Response; a slice, or an array of numbers or of truth values, gives Responses. The attributes are
    those of Response.
    """

    lines: Lines
    value: NDArray[np.complex128]
    sigma: Floats
    dof: Floats
    coherence: Floats
    valid: NDArray[np.bool_]
    first: NDArray[np.int64]
    sample: NDArray[np.int64]
    time_s: Floats
    schedule: Floats
    quantity: Quantity = "plant"
    unit: str = ""
    input_coherence: Floats = None  # type: ignore[assignment]
    weight: NDArray[np.complex128] = None  # type: ignore[assignment]
    distortion: Floats = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        _fill_unknown(self)

    def __len__(self) -> int:
        return len(self.sample)

    @overload
    def __getitem__(self, at: int) -> Response: ...
    @overload
    def __getitem__(self, at: slice | NDArray[Any]) -> Responses: ...
    def __getitem__(self, at: int | slice | NDArray[Any]) -> Response | Responses:
        rows: dict[str, Any] = {name: getattr(self, name)[at] for name in _PER_ROW}
        if isinstance(at, slice | np.ndarray):
            return replace(self, **rows)
        for name in PER_RESPONSE:
            rows[name] = rows[name].item()
        return Response(lines=self.lines, quantity=self.quantity, unit=self.unit, **rows)

    def between(self, from_s: float, to_s: float) -> Responses:
        """Those that speak for a span of time, ends included."""
        return self[np.flatnonzero((self.time_s >= from_s) & (self.time_s <= to_s))]

    def __iter__(self) -> Iterator[Response]:
        return (self[i] for i in range(len(self)))

    def bound(self, c: float = 2.0) -> Floats:
        """Radius that holds the truth with probability 1 − exp(−c²), shape (rows, lines)."""
        return widened(self.sigma, self.dof[:, np.newaxis], c)

    @property
    def magnitude_db(self) -> Floats:
        """20·log10|value|, shape (rows, lines)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(20 * np.log10(np.abs(self.value)))

    @classmethod
    def of(cls, response: Response) -> Responses:
        """One Response as a batch of one."""
        rows: dict[str, Any] = {name: np.array([getattr(response, name)]) for name in _PER_ROW}
        return cls(lines=response.lines, quantity=response.quantity, unit=response.unit, **rows)

    @classmethod
    def join(cls, parts: Sequence[Responses]) -> Responses:
        """Parts of one run, in order, as one; GridError where their lines differ."""
        if any((p.lines, p.quantity, p.unit) != (parts[0].lines, parts[0].quantity, parts[0].unit) for p in parts):
            raise GridError(
                "not-alike",
                "responses on different lines or of different quantities cannot be joined",
                "join responses of one run",
            )
        rows = joined(parts, _PER_ROW, "responses")
        return replace(parts[0], **rows)
