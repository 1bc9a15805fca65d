"""Errors of what is computed: signals, lines, excitations, fits, baselines, proposals, simulations and measurements."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError
from livebode.language import Message

ANY_EXCITATION = Message(
    "for noise or a single chirp, with power in a whole band, set tracking.estimator to 'lpm' (--estimator lpm)"
)
"""Remedy for an excitation that does not repeat."""


class SignalError(LivebodeError):
    """The samples do not fit what was asked: no excitation, no period, too short, channels with the wrong role.

    Examples
    --------
    >>> import livebode
    >>> try:
    ...     livebode.welch([0.0] * 10, [1.0] * 10, fs=1000, window=20)
    ... except livebode.SignalError as error:
    ...     print(error.code)
    signal.too-short
    """

    area: ClassVar[str] = "signal"
    codes: ClassVar[Mapping[str, str]] = {
        "channel-constant": "A channel is constant.",
        "channel-empty": "A channel has no finite sample.",
        "channel-unknown": "There is no channel of this name.",
        "empty": "There are no samples.",
        "friction-negative": "The friction that the samples show is negative: the input has the wrong sign.",
        "layout-differs": "The spectra that the drive sends do not fit the settings of the tracker.",
        "line-not-excited": "The excitation has no power at a line.",
        "lines-ambiguous": "More than one set of lines explains the excitation equally well.",
        "lines-inseparable": "The times of the samples of a channel do not determine the amplitudes at all lines.",
        "no-clean-samples": "There is no stretch without gaps and non-finite samples that is long enough.",
        "no-excitation": "The channel is a straight line, so it carries no excitation.",
        "no-line-above-noise": "The excitation repeats, but none of its lines exceeds the noise.",
        "no-response-there": "No valid response is near this time.",
        "no-valid-response": "No response is valid at any line.",
        "not-finite": "A channel has samples that are not finite.",
        "not-periodic": "The excitation does not repeat from window to window.",
        "output-cut-off": "The output stands still at its largest or smallest value in every period.",
        "output-dead-band": "The output stands still between values that move, in every period.",
        "pause-too-short": "There is no stretch without excitation that is long enough to look for hum.",
        "rate-differs": "The samples have another rate than is needed.",
        "repeated": "Samples or spectra came twice.",
        "role-shared": "Two roles that the estimator needs apart have the same channel.",
        "role-wrong": "The samples of a channel contradict the role that it was given.",
        "too-few-lines": "The responses have too few valid lines.",
        "too-short": "There are too few samples.",
        "wrong-quantity": "The responses are of another quantity than the one that is needed.",
    }


class GridError(LivebodeError):
    """A frequency is not a line of the grid, or data on different grids were to be combined.

    Examples
    --------
    >>> import livebode
    >>> try:
    ...     livebode.Lines.parse("25", rate_hz=4000, window=400)
    ... except livebode.GridError as error:
    ...     print(error.code)
    grid.line-off
    """

    area: ClassVar[str] = "grid"
    codes: ClassVar[Mapping[str, str]] = {
        "above-nyquist": "A frequency is not between 0 and half the rate.",
        "band-invalid": "The limits of the band are not two frequencies above 0, the lower one first.",
        "band-too-narrow": "The band has too few lines of the grid for this excitation.",
        "band-without-line": "The band has no line of the grid.",
        "bin-not-sent": "A bin is needed that the drive does not send.",
        "bins-unordered": "The bins of spectra are not ascending.",
        "hop-off": "The hop of spectra neither divides the window nor is a multiple of it.",
        "line-at-edge": "A line is too near to 0 or to the Nyquist frequency for the Hann window.",
        "line-duplicated": "A line is given more than once, or is both excited and quiet.",
        "line-off": "A frequency is not a line of the grid, or was not measured.",
        "lines-too-close": "Two lines are too near to each other for the Hann window.",
        "no-common-line": "Two runs have no line in common.",
        "no-line": "There is no line at all.",
        "not-alike": "Responses on different lines, or of different quantities or units, were to be combined.",
        "too-few-detection-lines": "The lines leave too few bins without excitation to estimate the noise from.",
        "too-many-lines": "The band has more lines than one experiment may have.",
        "window-missing": "Lines counted in bins need a window.",
        "window-out-of-range": "A window has too few or too many samples, or is not a whole number of them.",
        "window-too-long": "The period is longer than the longest window.",
    }


class DesignError(LivebodeError):
    """An excitation or experiment that meets the specification and the limits cannot be made.

    Examples
    --------
    >>> import livebode
    >>> axis = {"belt": {"drive": {"torque_n_m_max": 0.1}}, "excitation": {"band_hz": [20, 140], "window": 400}}
    >>> try:
    ...     livebode.design(axis, amplitude_n_m=1.0)
    ... except livebode.DesignError as error:
    ...     print(error.code)
    design.limit-exceeded
    """

    area: ClassVar[str] = "design"
    codes: ClassVar[Mapping[str, str]] = {
        "accuracy-not-reached": "The required sigma of each entry cannot be reached in the time and within the limits.",
        "amplitude-undetermined": "No amplitude can be chosen, as neither noise nor limits are known.",
        "crest-factor-not-reached": "No excitation with such a low crest factor was found.",
        "feedback-unknown": "The feedback of the loop is needed and not described.",
        "format-impossible": "The excitation cannot be written in this format.",
        "limit-exceeded": "The excitation would exceed a limit of the machine.",
        "line-without-power": "The excitation has no power at one of its lines.",
        "motion-unknown": "A quantity has a limit, but its range in the motion alone is not given.",
        "name-forbidden": "The name is not allowed in the language or format of the file.",
        "no-room-in-motion": "The motion alone exceeds a limit, or leaves no room for an excitation.",
        "not-enough-time": "The available time is shorter than two repetitions of the experiments.",
        "rounded-away": "Rounding to the steps of the drive changes the excitation too much.",
    }


class FitError(LivebodeError):
    """A model cannot be fitted, or what follows from a fit (margins, validation) cannot be computed.

    Examples
    --------
    >>> import livebode
    >>> try:
    ...     livebode.fit(livebode.example_responses().sel(frequency_hz=[20]), "two-mass")
    ... except livebode.FitError as error:
    ...     print(error.code)
    fit.too-few-lines
    """

    area: ClassVar[str] = "fit"
    codes: ClassVar[Mapping[str, str]] = {
        "loop-unknown": "Margins need the controllers of the loop, which are not described.",
        "no-continuous-model": "The discrete model has no counterpart in continuous time.",
        "no-model": "No model of the machine fits the responses.",
        "not-causal": "A model with a negative delay has no discrete counterpart.",
        "not-fitted": "The fit failed, so that there is no model to use.",
        "not-proper": "The numerator's degree is too high, or there are too many integrators.",
        "too-few-lines": "There are too few lines for the parameters of the model.",
    }


class BaselineError(LivebodeError):
    """A baseline cannot be learned, read, or compared with this run.

    Examples
    --------
    >>> import livebode
    >>> try:
    ...     livebode.Baseline.load("missing.json")
    ... except livebode.BaselineError as error:
    ...     print(error.code)
    baseline.absent
    """

    area: ClassVar[str] = "baseline"
    codes: ClassVar[Mapping[str, str]] = {
        "absent": "There is no file at the path of the baseline.",
        "covariate-constant": "A covariate has one value in all runs, so its influence cannot be learned.",
        "covariate-unknown": "No window of steady motion has a value of the covariates.",
        "covariates-correlated": "Two covariates vary together, so their influences cannot be told apart.",
        "covariates-without-machine": "Covariates need a model of the moving machine, and the runs give none.",
        "damaged": "A value in the file of the baseline is missing or cannot be used.",
        "newer-version": "The baseline was written by a newer version of livebode.",
        "no-runs": "There is no run to learn from.",
        "not-a-baseline": "The file is not a baseline.",
        "run-averaged": "A run's responses contain those before them, so that they are not independent.",
        "run-not-of-machine": "A run does not come from `livebode run` and so has no description of its machine.",
        "run-not-periodic": "A run is of an estimator for an excitation that does not repeat.",
        "run-repeated": "Two of the runs contain the same samples.",
        "run-without-responses": "A run has modes of the output alone, and no responses.",
        "runs-differ": "The runs have different lines, signals or options.",
        "settings-differ": "The baseline was learned with other settings than those of the run.",
        "too-few-windows": "The runs have too few windows to learn a baseline from.",
        "unreadable": "The system cannot read the file of the baseline.",
        "version": "The baseline was written by an older version of livebode, in another format.",
    }


class TuneError(LivebodeError):
    """No controller can be proposed from the responses, or none meets the specification.

    Examples
    --------
    >>> import livebode
    >>> livebode.TuneError.codes["loop-unchecked"]
    'It was not checked that the described controllers are those of the machine.'
    """

    area: ClassVar[str] = "tune"
    codes: ClassVar[Mapping[str, str]] = {
        "coherence-low": "Too few lines have the coherence that a proposal needs.",
        "controller-unsupported": "The described feedback is not a cascade whose gains can be tuned.",
        "lines-missing": "The lines do not cover the crossover or a resonance.",
        "loop-contradicted": "The recording contradicts the described controllers.",
        "loop-unchecked": "It was not checked that the described controllers are those of the machine.",
        "no-controller": "No controller is described between the two signals of an entry.",
        "no-mode": "The run has no valid fit of the mode that is to be shaped.",
        "no-stable-start": "No controller of the described structure is stable for every plant within the bounds.",
        "shaper-impossible": "No input shaper of a reasonable duration leaves so little vibration.",
        "specification-unmet": "No controller of the described structure meets the specification.",
    }


class MeasurementError(LivebodeError):
    """A measurement with an excitation was not possible, or was ended before it was complete.

    Examples
    --------
    >>> import livebode
    >>> livebode.MeasurementError.codes["silent"]
    'The samples ended while the excitation was played; it was ramped down.'
    """

    area: ClassVar[str] = "measurement"
    codes: ClassVar[Mapping[str, str]] = {
        "limit-exceeded": "A watched quantity left its limits; the excitation was ramped down.",
        "not-connected": "The controller is not connected so that it can play the excitation.",
        "not-ended": "The excitation is not zero although its end was requested.",
        "not-playable": "An excitation cannot be played on this kind of controller.",
        "played-differs": "The recorded excitation is not the designed one.",
        "silent": "The samples ended while the excitation was played; it was ramped down.",
    }


class SignalWarning(UserWarning):
    """A finding on the signals of `livebode.frf` or `livebode.track`: missing samples, doubtful roles, a drift.

    Examples
    --------
    >>> import warnings
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("error", SignalWarning)  # a finding stops the program
    """


class SimulationError(LivebodeError):
    """A machine with these parameters cannot be simulated.

    Examples
    --------
    >>> import livebode
    >>> import numpy as np
    >>> axis = livebode.BeltAxis(excitation_n_m=1e9 * np.ones(400), seconds=0.1)
    >>> try:
    ...     livebode.SimulatedAxis(axis).run()
    ... except livebode.SimulationError as error:
    ...     print(error.code)
    simulation.diverged
    """

    area: ClassVar[str] = "simulation"
    codes: ClassVar[Mapping[str, str]] = {
        "diverged": "The simulated machine does not stay finite.",
        "fmu-unusable": "The FMU cannot be read, started, or simulated on this computer.",
        "loop-unsupported": "A loop of this form cannot be simulated.",
        "parameters-impossible": "No machine has these parameters together.",
        "stroke-beyond-machine": "The stroke with its overrun reaches beyond the pulleys.",
        "unstable": "The closed loop is unstable.",
    }
