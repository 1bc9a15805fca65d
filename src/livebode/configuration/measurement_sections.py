"""Sections of axis.toml on what is measured: signals, lines, tracking, experiments, motion, output_only."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from livebode.configuration.section import ConfigurationSection, Positive
from livebode.core import CHANNELS_MAX, WINDOW_MAX, ConfigError, Field, Quantity, ValueCheck


def _one_or_several(names: str | list[str]) -> str | list[str]:
    """A list of one is that one."""
    return names[0] if isinstance(names, list) and len(names) == 1 else names


Channel = Annotated[str, Field(min_length=1)]
Channels = Annotated[
    Channel | Annotated[list[Channel], Field(min_length=1, max_length=CHANNELS_MAX)], ValueCheck(_one_or_several)
]


class SignalsSection(ConfigurationSection):
    """[signals]: names of the channels; in a recording also expressions, such as "-enc1" or "pos + 0.35*angle".

    A list of several channels makes the response a matrix, from all inputs to all outputs.

    Parameters
    ----------
    output
        Channel y, the response of the machine: a velocity or a position. A list of up to 8: the outputs of a matrix.
    input
        Channel u, the input of the plant, such as the torque or the current. Required by the estimators "direct" and
        "joint". A list of up to 8: the inputs of a matrix.
    excitation
        Channel w, the excitation that is added in the loop. Required by the estimators "joint" and "indirect". Of a
        matrix a list with one channel for each input.
    schedule
        Channel over which responses are shown, such as the position.
    ready
        Channel that shows whether the machine is ready (drive on, homed, not stopped): not zero, or see
        monitoring.ready_mask. A missing value is not ready. A response whose window contains a sample that is not
        ready is recorded and shown, but not assessed, and its alarms are suppressed. Of a matrix such a window does not
        count. Default: always ready.
    """

    outputs: Channels = Field(alias="output")
    inputs: Channels | None = Field(default=None, alias="input")
    excitations: Channels | None = Field(default=None, alias="excitation")
    schedule: Channel | None = None
    ready: Channel | None = None

    @property
    def output(self) -> str:
        """The output of a single response; ConfigError if there are several."""
        return _only("output", self.outputs)

    @property
    def input(self) -> str | None:
        """The input of a single response; ConfigError if there are several."""
        return None if self.inputs is None else _only("input", self.inputs)

    @property
    def excitation(self) -> str | None:
        """The excitation of a single response; ConfigError if there are several."""
        return None if self.excitations is None else _only("excitation", self.excitations)

    @property
    def is_matrix(self) -> bool:
        """Whether the response is a matrix."""
        return any(isinstance(names, list) for names in (self.outputs, self.inputs, self.excitations))

    def listed(self, role: str) -> list[str]:
        """The channels of "output", "input" or "excitation"; none where they are not named."""
        names = getattr(self, f"{role}s")
        return [names] if isinstance(names, str) else list(names or [])

    @property
    def named(self) -> list[str]:
        """All channels that are named, each once."""
        roles = [name for role in ("output", "input", "excitation") for name in self.listed(role)]
        return list(dict.fromkeys([*roles, *(name for name in (self.schedule, self.ready) if name)]))

    def over(self, names: Mapping[str, str | None]) -> SignalsSection:
        """The same with other channels for some roles."""
        fields = {"output": "outputs", "input": "inputs", "excitation": "excitations"}
        return self.model_copy(update={fields.get(role, role): name for role, name in names.items()})


def _only(role: str, names: str | list[str]) -> str:
    if isinstance(names, str):
        return names
    raise ConfigError(
        "value-invalid",
        f"signals.{role} lists {len(names)} channels, and one is needed here",
        f"name one of {', '.join(names)}",
        key=f"signals.{role}",
        value=list(names),
    )


class LinesSection(ConfigurationSection):
    """[lines]: the excited frequencies and the window.

    Parameters
    ----------
    frequencies
        Excited lines in Hz as start:stop:step or single values, joined by commas: "20:140:20, 175"; "k=1:300" counts in
        bins of the window. "auto": from the excitation of the recording.
    window
        Length of the window in samples. "auto": the measured period of the excitation.
    """

    frequencies: str = "auto"
    window: Annotated[int, Field(ge=3, le=WINDOW_MAX)] | Literal["auto"] = "auto"


class ExperimentsSection(ConfigurationSection):
    """[experiments]: the experiments that separate the inputs of a matrix, one after the other, repeatedly.

    Parameters
    ----------
    number
        Number of different experiments before they repeat. Default: as many as excitations, with "direct" as inputs.
    dwell_periods
        Periods of an experiment. Default: 2, with a single experiment 1.
    settle_periods
        Periods at its beginning that contain the transient from the experiment before it, and are not used. Default: 1,
        with a single experiment 0.
    start
        Number of the first sample of an experiment.
    memory
        Repetitions of all experiments that are remembered: those that the noise is estimated from.
    condition_max
        Condition number of the inputs over the experiments beyond which they are not separated.
    """

    number: Annotated[int, Field(ge=1, le=64)] | None = None
    dwell_periods: Annotated[int, Field(ge=1, le=1000)] | None = None
    settle_periods: Annotated[int, Field(ge=0, le=999)] | None = None
    start: Annotated[int, Field(ge=0, lt=1 << 62)] = 0
    memory: Annotated[int, Field(ge=2, le=1000)] = 8
    condition_max: Annotated[float, Field(ge=1, le=1e12)] = 1e3


class MotionSection(ConfigurationSection):
    """[motion]: with this section the effect of the axis's motion is removed from the responses.

    Parameters
    ----------
    radius_m
        Radius of the pulley: metres of travel per radian of the motor.
    chunk_s
        Seconds that are fitted together: one stroke. Responses are delayed by this time.
    driven_by
        The signal that drives the model. "excitation" needs the controllers in [loop].
    """

    radius_m: Positive
    chunk_s: Positive = 4.0
    driven_by: Literal["torque", "excitation"] = "torque"


OUTPUTS_MAX = 8
"""Most outputs of an output-only run."""


class OutputOnlySection(ConfigurationSection):
    """[output_only]: the modes are tracked from the output alone, also if the section is empty; there is no response.

    Parameters
    ----------
    others
        Channels of further outputs, measured at the same time as signals.output.
    band_hz
        Lowest and highest frequency of the modes, in Hz. Default: from a fortieth of the upper limit to 1.25 times the
        frequency below which 99 % of the output's power is.
    """

    others: Annotated[list[str], Field(max_length=OUTPUTS_MAX - 1)] = []
    band_hz: Annotated[list[Positive], Field(min_length=2, max_length=2)] | None = None


class TrackingSection(ConfigurationSection):
    """[tracking]: how responses and their bounds are estimated.

    Parameters
    ----------
    estimator
        "direct" from input and output, "joint" from both by the excitation, "indirect" from the closed loop and the
        controllers in [loop]. For noise and single chirps, which do not repeat: "lpm" (local polynomial method) or
        "welch".
    quantity
        The response that is estimated: "plant", "open loop", "closed loop" or "sensitivity". All but "plant" use the
        controllers in [loop]; without them, their action in the recorded signals, which "direct" cannot.
    hop
        Samples between responses. Default: for a recording a quarter of the window, with a schedule, [motion], a
        baseline or a ready signal a twentieth; for a live source 20 responses per second; a divisor of the window. A
        long recording at standstill has fewer: about 500,000 values.
    average
        Average over the previous periods, weighted by forgetting, instead of using only the newest window.
    forgetting
        Weight of a period relative to the next one; 1 forgets nothing. Default: 0.8; 1 for the average of a recording.
    noise
        Source of the bounds. "auto": the scatter between periods and, where the schedule moves, the detection lines
        (non-excited bins). "periods": always the scatter. "quiet": the larger of the two at standstill.
    differenced
        Channels that are differenced before the DFT: a position that drifts. Their trend is not subtracted.
    trend
        Whether the trend of a signal that drifts, which is slower than the lines, is subtracted before the DFT, in a
        recording. "auto": where it matters at a line, at standstill; "subtract": always; "keep": never.
    hann
        Use a Hann window, from three bins; for an axis in motion.
    spikes
        Channels that are checked for spikes; windows with a spike are excluded.
    dtype
        Number format of the kernel; "float32" gives the result of a drive without double precision.
    ripple
        Orders of a torque ripple, such as [[201.0, 0.05]]: cycles per unit of the schedule, and amplitude in the unit
        of the input. The bounds contain it. Default: from the baseline, or found with [motion].
    accept_roles
        Accept the roles in [signals] whatever the recording shows.
    all_periods
        Include a transient at the start of a recording, and periods that differ from those around them.
    """

    estimator: Literal["direct", "joint", "indirect", "lpm", "welch"] = "joint"
    quantity: Quantity = "plant"
    hop: Annotated[int, Field(ge=1)] | None = None
    average: bool = False
    forgetting: Annotated[float, Field(gt=0, le=1)] | None = None
    noise: Literal["auto", "periods", "quiet"] = "auto"
    differenced: list[str] = []
    trend: Literal["auto", "subtract", "keep"] = "auto"
    hann: bool = False
    spikes: list[str] = []
    dtype: Literal["float64", "float32"] = "float64"
    ripple: list[Annotated[list[Positive], Field(min_length=2, max_length=2)]] = []
    accept_roles: bool = False
    all_periods: bool = False

    @property
    def periodic(self) -> bool:
        """Whether the estimator needs an excitation that repeats."""
        return self.estimator not in ("lpm", "welch")
