"""Response: a frequency response with its bounds, and a batch of them; as a line of text and a table of a notebook."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.arrays import Floats
from livebode.core._frequency_response import PER_LINE, FrequencyResponse, Quantity
from livebode.core.clock import moment
from livebode.core.distributions import CIRCLE_FACTOR, COVERAGE
from livebode.core.errors import GridError
from livebode.core.lines import Lines, ends
from livebode.core.rows import RowArrays
from livebode.dataclass import dataclass
from livebode.plugins import loaded

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset


def widened(sigma: ArrayLike, dof: ArrayLike, c: float) -> Floats:
    """Radius around an estimate that covers the truth with probability 1 − exp(−c²): 63.2 % for 1, 95 % for 1.73.

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


def with_distortion(sigma: Floats, distortion: Floats) -> Floats:
    """Standard deviation `sigma` with a distortion, which counts where it is known, that is finite.

    >>> with_distortion(np.array([3.0, 3.0, 3.0]), np.array([4.0, np.nan, np.inf]))
    array([5., 3., 3.])
    """
    return np.asarray(np.hypot(sigma, np.where(np.isfinite(distortion), distortion, 0.0)))


@dataclass(frozen=True, eq=False)
class Response(FrequencyResponse):
    """The frequency response of a machine at one moment, at Lines. Immutable.

    Shapes are (lines,). `value` is only meaningful together with its bounds and `valid`.

    Attributes
    ----------
    lines
        Where it was measured.
    value
        Complex response, `unit`; NaN where it could not be computed.
    sigma
        Standard deviation, E|value − truth|² = sigma², unit of `value`; NaN where not yet known.
    dof
        Complex degrees of freedom behind `sigma`, one number for all lines; bounds widen by it (`bound`).
    coherence
        γ² of eq. (18) between 0 and 1; NaN where not yet known.
    valid
        False where the window contains a start, a gap, a non-finite or excluded sample, or no excitation.
    first, sample
        Numbers of the oldest and the newest sample of the window.
    time_s
        Effective time: the centre of its window (weighted mean of the centres where periods are averaged), in the
        source's clock. It is half a window older than `sample`.
    schedule
        The scheduling signal (such as position) at that time; NaN without one.
    quantity, unit
        Quantity of the response: plant G, open loop L, closed loop T or sensitivity S.
    input_coherence
        γ² between excitation and input, where `coherence` is that between excitation and output; NaN where not known.
    weight
        Weight of this response in a mean, so that the mean is a ratio of averages: plant input over excitation in the
        window, U/W, or |U|² for the direct estimator; NaN where not known.
    distortion
        Error of the value from effects that repeat with the excitation but are not linear (friction, backlash, encoder
        steps), unit of `value`. `sigma` includes it; NaN where it cannot be measured, infinite at a line that is
        invalid because of such an effect (distortion, mains hum, sensor steps).
    variation
        Standard deviation of the response over the time that the value describes, because the machine changes
        meanwhile, unit of `value`. `sigma` includes it; 0 where no change is significant, NaN where it is not known.
    ready
        False where the machine was not ready at a sample of the window (`signals.ready`): the response is not
        assessed. True without such a channel.
    estimator
        How it was estimated, of a response of `livebode.frf`, `track` or `welch`: "joint", "direct", "lpm" or "welch".
        Empty for others, whose settings have it.

    Examples
    --------
    >>> import livebode
    >>> response = livebode.example_responses()[-1]
    >>> response
    <Response: plant in rad/s/(N m), 13 lines, 20 … 140 Hz, all valid, at 0.95 s>
    >>> response.magnitude_db[:3].round(1), response.phase_deg[:3].round()
    (array([  2.6,  -2.9, -13.3]), array([-90., -88., -71.]))
    >>> response.bound().shape, round(float(response.coherence.min()), 2)
    ((13,), 1.0)
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
    variation: Floats = None  # type: ignore[assignment]
    ready: bool = True
    estimator: str = ""

    def __post_init__(self) -> None:
        _fill_unknown(self)

    def bound(self, c: float = CIRCLE_FACTOR) -> Floats:
        """Radius that covers the truth with probability 1 − exp(−c²), 95 % by default; (lines,), see `widened`."""
        return widened(self.sigma, self.dof, c)

    def response(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        """The measured values at lines of this Response, so that it is a Model; as calling it."""
        return np.asarray(self(frequency_hz))

    def _batch(self) -> Responses:
        return Responses.of(self)

    def to_xarray(self) -> Dataset:
        return super().to_xarray().isel(time_s=0)

    def to_pandas(self) -> DataFrame:
        return super().to_pandas().droplevel("time_s")

    def to_frd(self) -> Any:
        """python-control's FrequencyResponseData of the valid lines, in rad/s, without bounds (extra `control`).

        It is the response of the sampled plant; it is not interpolated (`smooth` is off).

        Raises
        ------
        ExtraError
            If python-control is not installed.

        Examples
        --------
        >>> from livebode import example_responses
        >>> frd = example_responses()[-1].to_frd()
        >>> (frd.omega[:3] / (2 * np.pi)).round(9).tolist()
        [20.0, 30.0, 40.0]
        """
        from livebode.core._conversion import frd

        return frd(self)

    def __repr__(self) -> str:
        return of_response(self)

    def _repr_html_(self) -> str:
        return html_of_response(self)


PER_RESPONSE = ("dof", "first", "sample", "time_s", "schedule", "ready")
"""Attributes with one value for the response."""

_PER_ROW = PER_LINE + PER_RESPONSE
_COMMON = ("lines", "quantity", "unit", "estimator")


def _fill_unknown(of: Response | Responses) -> None:
    """NaN in the shape of the value, for an attribute that the source of the responses does not supply."""
    for name in ("input_coherence", "weight", "distortion", "variation"):
        if getattr(of, name) is None:
            kind = np.complex128 if name == "weight" else np.float64
            object.__setattr__(of, name, np.full(np.shape(of.value), np.nan, dtype=kind))
    if getattr(of, "ready", True) is None:
        object.__setattr__(of, "ready", np.ones(len(of.value), dtype=np.bool_))


@dataclass(frozen=True, eq=False)
class Responses(RowArrays, FrequencyResponse, Sequence[Response]):
    """Consecutive responses, one for each hop, as arrays: (rows, lines) for attributes of a line, (rows,) for the rest.

    Indexing gives a Response; a slice, or an array of numbers or of truth values, gives Responses. The attributes are
    those of Response.

    Examples
    --------
    >>> import livebode
    >>> responses = livebode.example_responses()
    >>> responses.magnitude_db.shape, len(responses[10:20])
    ((40, 13), 10)
    >>> for response in responses[-2:]:
    ...     print(response)
    <Response: plant in rad/s/(N m), 13 lines, 20 … 140 Hz, all valid, at 0.92 s>
    <Response: plant in rad/s/(N m), 13 lines, 20 … 140 Hz, all valid, at 0.95 s>
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
    variation: Floats = None  # type: ignore[assignment]
    ready: NDArray[np.bool_] = None  # type: ignore[assignment]
    estimator: str = ""

    _SHARED = _COMMON

    def __post_init__(self) -> None:
        _fill_unknown(self)

    @overload
    def __getitem__(self, rows: int) -> Response: ...
    @overload
    def __getitem__(self, rows: slice | NDArray[Any]) -> Responses: ...
    def __getitem__(self, rows: int | slice | NDArray[Any]) -> Response | Responses:
        if isinstance(rows, slice | np.ndarray):
            return super().__getitem__(rows)
        values: dict[str, Any] = {name: getattr(self, name)[rows] for name in _PER_ROW}
        for name in PER_RESPONSE:
            values[name] = values[name].item()
        return Response(**values, **{name: getattr(self, name) for name in _COMMON})

    def between(self, from_s: float, to_s: float) -> Responses:
        """Responses whose effective time is in a range, ends included."""
        return self[np.flatnonzero((self.time_s >= from_s) & (self.time_s <= to_s))]

    def __iter__(self) -> Iterator[Response]:
        return (self[i] for i in range(len(self)))

    def bound(self, c: float = CIRCLE_FACTOR) -> Floats:
        """Radius that covers the truth with probability 1 − exp(−c²), 95 % by default, shape (rows, lines)."""
        return widened(self.sigma, self.dof[:, np.newaxis], c)

    def newest(self) -> Response | None:
        """The last one with a valid line; None if there is none."""
        rows = np.flatnonzero(self.valid.any(axis=1))
        return self[int(rows[-1])] if rows.size else None

    def sel(self, *, frequency_hz: slice | ArrayLike = slice(None), time_s: slice = slice(None)) -> Responses:
        """The part at some lines and times: slices with both ends included, or a list of measured lines.

        Names and rules are those of xarray and of the dimensions in `to_xarray`. Brackets count rows:
        ``responses[20:80]`` are 60 responses, not the lines from 20 to 80 Hz.

        Raises
        ------
        GridError
            If no line is within the slice, or a frequency of the list is not a measured line.

        Examples
        --------
        >>> from livebode import example_responses
        >>> responses = example_responses()
        >>> responses.sel(frequency_hz=slice(40, 100), time_s=slice(0.2, 0.3)).value.shape
        (4, 7)
        """
        part = super().sel(frequency_hz=frequency_hz)
        return part if time_s == slice(None) else part.between(*ends(time_s, "time_s"))

    def mean(self) -> Response:
        """The mean of all rows, with the bound of a mean: `livebode.fitting.mean_response`, whose rules it follows.

        Raises
        ------
        SignalError
            If no line is ever valid.

        Examples
        --------
        >>> from livebode import example_responses
        >>> responses = example_responses()
        >>> mean = responses.mean()
        >>> mean.value.shape, bool(mean.bound().max() < responses[-1].bound().max())
        ((13,), True)
        """
        mean: Responses = loaded("livebode.fitting:mean_response")(self)  # a floor above, as what draws
        return mean[0]

    def _batch(self) -> Responses:
        return self

    def __repr__(self) -> str:
        return of_responses(self)

    def _repr_html_(self) -> str:
        return html_of_responses(self)

    @classmethod
    def of(cls, response: Response) -> Responses:
        """One Response as a batch of one."""
        rows: dict[str, Any] = {name: np.array([getattr(response, name)]) for name in _PER_ROW}
        return cls(**rows, **{name: getattr(response, name) for name in _COMMON})

    @classmethod
    def _not_alike(cls, _: Sequence[Responses]) -> GridError:
        return GridError(
            "not-alike",
            "responses on different lines or of different quantities cannot be joined",
            "join responses of one run",
        )


_ROWS_MAX = 24
_DRAWN_MAX = 2000
"""Responses behind the newest one in the picture of a notebook."""
_HEADS = ("frequency", "magnitude", "phase", f"bound ({100 * COVERAGE:g} %)", "coherence")


def of_response(response: Response) -> str:
    """
    >>> from livebode import example_responses
    >>> example_responses()[-1]
    <Response: plant in rad/s/(N m), 13 lines, 20 … 140 Hz, all valid, at 0.95 s>
    """
    known = int(np.count_nonzero(response.valid))
    valid = "all valid" if known == len(response.lines) else f"{known} valid"
    return f"<Response: {_named(response)}, {_span(response.lines)}, {valid}, at {moment(response.time_s, 2)}>"


def of_responses(many: Responses) -> str:
    """
    >>> from livebode import example_responses
    >>> example_responses()
    <Responses: 40 of plant in rad/s/(N m), 37 valid, 13 lines, 20 … 140 Hz, 0.05 s … 0.95 s>
    """
    if not len(many):
        return f"<Responses: none of {_named(many)}, {_span(many.lines)}>"
    valid = np.flatnonzero(many.valid.any(axis=1))
    # The windows of the first responses begin before the recording, and so may their effective times.
    time_s = many.time_s[valid] if valid.size else many.time_s
    times = f"{moment(time_s[0], 2)} … {moment(time_s[-1], 2)}"
    return f"<Responses: {len(many)} of {_named(many)}, {len(valid)} valid, {_span(many.lines)}, {times}>"


def html_of_response(response: Response) -> str:
    """HTML: all in a line, the Bode plot, and the values folded."""
    return _paragraph(of_response(response)) + _picture(Responses.of(response)) + _table(response)


def html_of_responses(many: Responses) -> str:
    """HTML: all in a line, the Bode plot of the last ones, and the values of the newest valid one folded."""
    newest = many.newest()
    if newest is None:
        return _paragraph(of_responses(many))
    return _paragraph(of_responses(many)) + _picture(many[-_DRAWN_MAX:]) + _table(newest)


def _picture(many: Responses) -> str:
    drawn: str = loaded("livebode.pictures:picture_html")(many)  # a floor above, as what `plot` draws
    return drawn


def _table(response: Response) -> str:
    """A row for each line, thinned to `_ROWS_MAX`; lines that are not valid are grey."""
    count = len(response.lines)
    shown = np.unique(np.linspace(0, count - 1, min(count, _ROWS_MAX)).round().astype(int))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = response.bound() / np.abs(response.value)
    values = (
        response.frequency_hz,
        response.magnitude_db,
        response.phase_deg,
        share,
        response.coherence,
        response.valid,
    )
    rows = [_row(*row) for row in zip(*(part[shown] for part in values))]
    thinned = f"<caption>{len(rows)} of {count} lines</caption>" if len(rows) < count else ""
    heads = "".join(f"<th>{head}</th>" for head in _HEADS)
    table = f"<table>{thinned}<thead><tr>{heads}</tr></thead>{''.join(rows)}</table>"
    return f"<details><summary>values</summary>{table}</details>"


def _row(f: float, db: float, deg: float, share: float, coherence: float, valid: bool) -> str:
    cells = (f"{f:.6g} Hz", f"{db:.2f} dB", f"{deg:.1f}°", f"{100 * share:.2g} %", f"{coherence:.3f}")
    look = "" if valid else ' style="opacity: 0.4"'
    return f"<tr{look}>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"


def _paragraph(text: str) -> str:
    from html import escape  # its table of entities is loaded for a notebook only

    return f"<div>{escape(text)}</div>"


def _named(of: Response | Responses) -> str:
    named = f"{of.quantity} in {of.unit}" if of.unit else str(of.quantity)
    return f"{named}, {of.estimator} estimate" if of.estimator else named


def _span(lines: Lines) -> str:
    f = lines.frequency_hz
    if len(f) == 1:
        return f"1 line, {f[0]:g} Hz"
    return f"{len(f)} lines, {f[0]:g} … {f[-1]:g} Hz"
