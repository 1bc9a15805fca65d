"""What a Response and a batch of them share: complex values over Lines, in the last dimension of every array."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.arrays import Complex, Floats
from livebode.core.distributions import CIRCLE_FACTOR
from livebode.core.lines import Lines, position, within
from livebode.plugins import loaded

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

    from livebode.core._response import Responses

PlotKind = Literal["bode", "nyquist", "nichols"]


Quantity = Literal["plant", "open loop", "closed loop", "sensitivity"]

PER_LINE = ("value", "sigma", "coherence", "valid", "input_coherence", "weight", "distortion", "variation")
"""Attributes with one value for each line."""


def decibels(value: Complex | Floats) -> Floats:
    """20·log10|value|, −inf for zero, NaN for NaN, without warnings."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(20 * np.log10(np.abs(value)))


class FrequencyResponse:
    """Access by frequency, decibels and degrees, pictures and conversions.

    A shape of (…, lines) is (lines,) for a `Response`, and (rows, lines) for `Responses`.
    """

    lines: Lines
    value: NDArray[np.complex128]
    sigma: Floats
    valid: NDArray[np.bool_]
    distortion: Floats
    variation: Floats
    quantity: Quantity
    unit: str

    def _batch(self) -> Responses:
        """Responses with this one as the only row, or all."""
        raise NotImplementedError

    def __call__(self, frequency_hz: ArrayLike) -> Any:
        """Complex value at measured lines, `unit`; shape (…) for one frequency, (…, frequencies) for several.

        Frequencies are in Hz; python-control's FRD is called with jω. As there, a frequency that was not measured is
        an error: a resonance may be located between two lines. A fitted model has a `response` at any frequency.
        The value may be one that `valid` excludes.

        Raises
        ------
        GridError
            If a frequency is not a measured line; the message contains the nearest ones.

        Examples
        --------
        >>> from livebode import example_responses
        >>> response = example_responses()[-1]
        >>> bool(response(60.0) == response.value[4])
        True
        >>> response(55.0)
        Traceback (most recent call last):
        ...
        livebode.GridError: 55 Hz is not a measured line, and a measured response is not interpolated; choose a \
measured line; the nearest are 50 and 60 Hz
        """
        return self.value[..., position(self.lines, frequency_hz)]

    @property
    def frequency_hz(self) -> Floats:
        """Frequency of each line, Hz, shape (lines,), ascending."""
        return self.lines.frequency_hz

    @property
    def omega(self) -> Floats:
        """Frequency of each line, rad/s, shape (lines,): 2π·`frequency_hz`, as python-control has it."""
        return 2 * np.pi * self.lines.frequency_hz

    @property
    def magnitude(self) -> Floats:
        """|value|, `unit`, shape (…, lines)."""
        return np.abs(self.value)

    @property
    def phase(self) -> Floats:
        """Phase of each value, rad, −π … π, shape (…, lines); not unwrapped."""
        return np.angle(self.value)

    @property
    def noise(self) -> Floats:
        """Standard deviation by noise, `unit`, shape (…, lines): what remains of sigma without its known other parts.

        sigma² = noise² + distortion² + variation²; a part that is not known counts as zero.
        """
        others = [np.where(np.isfinite(part), part, 0.0) for part in (self.distortion, self.variation)]
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            shares = [(part / self.sigma) ** 2 for part in others]  # the squares of huge values would overflow
            of_noise = self.sigma * np.sqrt(np.maximum(1 - shares[0] - shares[1], 0.0))
        return np.asarray(np.where(self.sigma > 0, of_noise, self.sigma))

    @property
    def magnitude_db(self) -> Floats:
        """20·log10|value|, dB re 1 `unit`, shape (…, lines)."""
        return decibels(self.value)

    @property
    def phase_deg(self) -> Floats:
        """Phase of each value, degrees, −180 … 180, shape (…, lines); not unwrapped."""
        return np.asarray(np.degrees(np.angle(self.value)))

    def sel(self, *, frequency_hz: slice | ArrayLike) -> Self:
        """The part at some lines: a slice in Hz with both ends included, or a list of measured lines.

        Name and rule are those of xarray, and `frequency_hz` is the name of the dimension in `to_xarray`. Brackets
        count rows: ``responses[20:80]`` are 60 responses, not the lines from 20 to 80 Hz.

        Raises
        ------
        GridError
            If no line is within the slice, or a frequency of the list is not a measured line.

        Examples
        --------
        >>> from livebode import example_responses
        >>> response = example_responses()[-1]
        >>> response.sel(frequency_hz=slice(40, 70)).frequency_hz
        array([40., 50., 60., 70.])
        >>> response.sel(frequency_hz=[60, 140]).value.shape
        (2,)
        """
        if isinstance(frequency_hz, slice):
            positions = within(self.lines, frequency_hz)
        else:
            positions = np.unique(position(self.lines, np.atleast_1d(frequency_hz)))
        columns: dict[str, Any] = {name: getattr(self, name)[..., positions] for name in PER_LINE}
        return replace(self, lines=self.lines.take(positions), **columns)  # type: ignore[type-var]

    def plot(
        self,
        kind: PlotKind = "bode",
        *,
        axes: Any = None,
        ax: Any = None,
        bounds: bool = True,
        c: float = CIRCLE_FACTOR,
        label: str | None = None,
        color: Any = None,
    ) -> Any:
        """Draw the valid lines as Bode plot, Nyquist plot or Nichols chart, with bounds.

        Of `Responses`, the newest valid one is drawn, and behind it the others: their range of 5–95 % in a Bode plot,
        dots in the others. The phase is unwrapped along frequency. A straight line between two measured lines only
        guides the eye.

        Parameters
        ----------
        kind
            ``"bode"`` (dB and degrees over logarithmic Hz), ``"nyquist"`` (imaginary over real part, same scale) or
            ``"nichols"`` (dB over degrees).
        axes
            Matplotlib Axes to draw on: two for ``"bode"`` (magnitude, phase), one for the others. Default: a new figure
            of pyplot, with a legend.
        ax
            Another name of `axes`, as pandas has it.
        bounds
            Whether to draw the bounds.
        c
            Radius of the bounds in sigma: they cover the true value with probability 1 − exp(−c²); default: 95 %. In
            the Nyquist plot a bound is a circle; in the others it is the exact image of this circle.
        label
            Name in the legend; default: the quantity.
        color
            Any colour of Matplotlib; default: the next of the axes.

        Returns
        -------
        numpy.ndarray of Axes, or Axes
            Two for ``"bode"``, else one.

        Raises
        ------
        UsageError
            If there is no such kind, or `axes` are not as many as it needs.

        Examples
        --------
        >>> from livebode import example_responses
        >>> magnitude, phase = example_responses().plot()
        >>> magnitude.get_ylabel(), phase.get_xlabel()
        ('magnitude in dB re 1 rad/s/(N m)', 'frequency in Hz')
        >>> import matplotlib.pyplot as plt
        >>> figure, axes = plt.subplots()
        >>> _ = example_responses()[-1].plot("nyquist", axes=axes, c=1)
        >>> axes.get_legend_handles_labels()[1]
        ['plant', 'bound: 63.2 %']
        """
        draw = loaded("livebode.pictures:plot_responses")  # a floor above: pictures need what they show
        axes = ax if axes is None else axes
        return draw(self._batch(), kind, axes=axes, c=c if bounds else None, label=label, color=color)

    bode = plot

    def to_xarray(self) -> Dataset:
        """A labelled Dataset (extra `xarray`).

        Dimensions ``time_s`` and ``frequency_hz``, both coordinates; ``schedule``, ``first`` and ``sample`` are
        coordinates along time. Variables ``response`` (complex), ``sigma``, ``coherence`` and ``valid`` over both,
        ``dof`` over time. Of a Response, the times are scalars. Each has attributes ``units`` and ``long_name``; the
        Dataset has ``quantity``, ``rate_hz`` and ``window``.

        Raises
        ------
        ExtraError
            If xarray is not installed.

        Examples
        --------
        >>> from livebode import example_responses
        >>> dataset = example_responses().to_xarray()
        >>> dict(dataset.sizes), dataset["response"].attrs["units"]
        ({'time_s': 40, 'frequency_hz': 13}, 'rad/s/(N m)')
        """
        from livebode.core._conversion import dataset

        return dataset(self._batch())

    def to_pandas(self) -> DataFrame:
        """A DataFrame with a row for each line (extra `pandas`).

        The index is ``frequency_hz`` for a Response, and ``time_s``, ``frequency_hz`` for Responses. Columns:
        ``response`` (complex), ``magnitude_db``, ``phase_deg``, ``sigma``, ``coherence``, ``valid``. ``attrs`` has
        ``quantity``, ``rate_hz``, ``window``, and ``units`` by column.

        Raises
        ------
        ExtraError
            If pandas is not installed.

        Examples
        --------
        >>> from livebode import example_responses
        >>> frame = example_responses()[-1].to_pandas()
        >>> frame.index.tolist()[:3], frame.attrs["units"]["sigma"]
        ([20.0, 30.0, 40.0], 'rad/s/(N m)')
        """
        from livebode.core._conversion import frame

        return frame(self._batch())
