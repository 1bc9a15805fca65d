"""Axis: configuration of one machine as plain data, read from TOML and validated completely before the start."""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from livebode.configuration.machine_section import MachineSection
from livebode.configuration.output_only import check_output_only
from livebode.configuration.ready import ReadyCondition, ready_condition
from livebode.configuration.report_section import ReportSection, report_error
from livebode.configuration.section import File, Language
from livebode.configuration.toml_file import one_line, read_table, shortened
from livebode.core import PID, Cascade, ConfigError, Gain, Loop, Model, PositionPD, Quantity, counted, nearest_name
from livebode.output_only import OUTPUTS_MAX
from livebode.sources.live import SourceSettings, checked_address
from livebode.sources.live.settings import check_keys

SAME_RATE = 1e-6
BUDGET_BYTES_MIN = 16 << 20
MAY_BE_SECRET = {
    *("url", "username", "password_env", "password_file"),
    *("token_env", "token_file", "viewer_token_env", "viewer_token_file"),
}
Ticks = Annotated[int, Field(ge=0)]
Bits = Annotated[int, Field(ge=0, lt=1 << 53)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class SignalsSection(_Section):
    """[signals]: names of the channels; in a recording also expressions, such as "-enc1" or "pos + 0.35*angle".

    Parameters
    ----------
    output
        Channel y, the response of the machine: a velocity or a position.
    input
        Channel u, the input of the plant, such as the torque or the current. Required by the estimators "direct" and
        "joint".
    excitation
        Channel w, the excitation that is added in the loop. Required by the estimators "joint" and "indirect".
    schedule
        Channel over which responses are shown, such as the position.
    ready
        Channel that shows whether the machine is ready (drive on, homed, not stopped): not zero, or see
        monitoring.ready_mask. A missing value is not ready. A response whose window contains a sample that is not
        ready is recorded and shown, but not assessed, and its alarms are suppressed. Default: always ready.
    """

    output: str
    input: str | None = None
    excitation: str | None = None
    schedule: str | None = None
    ready: str | None = None


class LinesSection(_Section):
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
    window: int | Literal["auto"] = "auto"


class TrackingSection(_Section):
    """[tracking]: how responses and their bounds are estimated.

    Parameters
    ----------
    estimator
        "direct" from input and output, "joint" from both by the excitation, "indirect" from the closed loop and the
        controllers in [loop]. For noise and single chirps, which do not repeat: "lpm" (local polynomial method) or
        "welch".
    quantity
        The response that is estimated. All but "plant" need the controllers in [loop].
    hop
        Samples between responses. Default: for a recording a twentieth of the window, for a live source 20 responses
        per second; the nearest divisor of the window.
    average
        Average over the previous periods, weighted by forgetting, instead of using only the newest window.
    forgetting
        Weight of a period relative to the next one; 1 forgets nothing.
    noise
        Source of the bounds. "auto": the scatter between periods and, where the schedule moves, the detection lines
        (non-excited bins). "periods": always the scatter. "quiet": the larger of the two at standstill.
    differenced
        Channels that are differenced before the DFT: a position that drifts.
    hann
        Use a Hann window, from three bins.
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
    forgetting: Annotated[float, Field(gt=0, le=1)] = 0.8
    noise: Literal["auto", "periods", "quiet"] = "auto"
    differenced: list[str] = []
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


class MotionSection(_Section):
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


class OutputOnlySection(_Section):
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


class MonitoringSection(_Section):
    """[monitoring]: comparison with a baseline.

    Parameters
    ----------
    baseline
        File from `livebode learn`, relative to this file: the run is compared with it. Default: none.
    covariates
        Channels on which the parameters of a baseline may depend, such as a temperature; the same in all runs that are
        learned. A run with a baseline uses the covariates of the baseline.
    false_alarm_interval_days
        Mean time between false alarms, at least, in days of judged motion.
    ready_mask
        Bits of signals.ready that are compared with ready_value, if it is a status word: of CiA 402 (object 0x6041)
        ready_mask = 0x6F and ready_value = 0x27 are "operation enabled". Default: all bits.
    ready_value
        Value of these bits if the machine is ready. Default: all of ready_mask.
    """

    baseline: File | None = None
    covariates: Annotated[list[str], Field(max_length=4)] = []
    false_alarm_interval_days: Positive = 30.0
    ready_mask: Bits | None = None
    ready_value: Bits | None = None


class _ControllerSection(_Section):
    """What all controllers have.

    Parameters
    ----------
    rate_hz
        Computations of the controller per second, in Hz.
    rate_divider
        Samples of the recording for which one output is held: the sampling rate divided by rate_hz.
    hold
        "zero-order": the output is held between computations. "none": the controller interpolates.
    delay_ticks
        Delay between reading the input and acting, in samples of the recording, in addition to the hold.
    """

    rate_hz: Positive
    rate_divider: Annotated[int, Field(ge=1)] = 1
    hold: Literal["zero-order", "none"] = "zero-order"
    delay_ticks: Ticks = 0


class PIDSection(_ControllerSection):
    """A controller gain·(1 + I/Ti + Td·D/(1 + Tf·D)).

    Parameters
    ----------
    gain
        Proportional gain: of [loop.velocity] in units of the input per unit of velocity, of [loop.position] in 1/s.
    integral_time_s
        Integral time Ti in seconds. Default: no integrator.
    derivative_time_s
        Derivative time Td in seconds; 0: no derivative.
    derivative_filter_s
        Time constant Tf of the derivative's filter in seconds; 0: no filter.
    integrator
        Integration rule.
    """

    gain: float
    integral_time_s: Annotated[float, Field(gt=0)] = inf
    derivative_time_s: Annotated[float, Field(ge=0)] = 0.0
    derivative_filter_s: Annotated[float, Field(ge=0)] = 0.0
    integrator: Literal["backward", "forward", "trapezoidal", "continuous"] = "backward"


class PositionPDSection(_ControllerSection):
    """[loop.position_pd]: a PD controller kv·(kp + D) of the position, instead of [loop.velocity] and [loop.position].

    Parameters
    ----------
    position_gain
        Position gain kp in 1/s.
    velocity_gain
        Velocity gain kv, in units of the input per unit of velocity.
    smoothed
        D is the difference of the means of two neighbouring positions.
    """

    position_gain: float
    velocity_gain: float
    smoothed: bool = False


class LoopSection(_Section):
    """[loop]: the controllers, the injection point of the excitation, and the times at which signals are logged.

    Parameters
    ----------
    excitation_at
        Injection point: where the excitation is added.
    entry_gain
        Injection gain: factor on the excitation at the injection point.
    input_logged
        The input is logged before or after the controller's update.
    excitation_logged
        The excitation is logged before or after the controller's update.
    output_logged
        The output is logged before or after the controller's update.
    velocity
        The velocity controller. It belongs to an output that is a velocity.
    position
        The position controller around the velocity controller.
    position_pd
        The whole controller of an output that is a position.
    """

    excitation_at: Literal["plant input", "velocity reference", "output"] = "plant input"
    entry_gain: float = 1.0
    input_logged: Literal["before", "after"] = "after"
    excitation_logged: Literal["before", "after"] = "after"
    output_logged: Literal["before", "after"] = "before"
    velocity: PIDSection | None = None
    position: PIDSection | None = None
    position_pd: PositionPDSection | None = None

    def build(self, rate_hz: float) -> Loop:
        """The Loop of this description, recorded at `rate_hz`; ConfigError if its parts do not form one."""
        for name in ("velocity", "position", "position_pd"):
            part: _ControllerSection | None = getattr(self, name)
            if part is not None and abs(part.rate_hz * part.rate_divider / rate_hz - 1) > SAME_RATE:
                held = counted(part.rate_divider, "tick")
                raise ConfigError(
                    "rate-mismatch",
                    f"loop.{name} has a rate of {part.rate_hz:g} Hz and holds {held}, which gives "
                    f"{part.rate_hz * part.rate_divider:g} Hz, but the sampling rate is {rate_hz:g} Hz",
                    "set rate_divider to the sampling rate divided by the rate of the controller",
                    key=f"loop.{name}",
                    rate_hz=rate_hz,
                    controller_rate_hz=part.rate_hz,
                    rate_divider=part.rate_divider,
                )
        return Loop(
            feedback=self._feedback(),
            entry=self._entry(),
            input_logged=self.input_logged,
            excitation_logged=self.excitation_logged,
            output_logged=self.output_logged,
        )

    def _feedback(self) -> Model | None:
        if self.position_pd is not None:
            if self.velocity or self.position:
                raise ConfigError(
                    "key-conflict",
                    "loop.position_pd is the whole controller",
                    "remove loop.velocity and loop.position",
                    key="loop.position_pd",
                )
            return PositionPD(**self.position_pd.model_dump())
        if self.velocity is None:
            if self.position is not None:
                raise ConfigError(
                    "incomplete",
                    "loop.position needs loop.velocity inside it",
                    "describe the velocity controller also",
                    key="loop.velocity",
                )
            return None
        velocity = PID(**self.velocity.model_dump())
        return velocity if self.position is None else Cascade(velocity, PID(**self.position.model_dump()))

    def _entry(self) -> Model | None:
        if self.excitation_at == "plant input":
            return None if self.entry_gain == 1.0 else Gain(self.entry_gain)
        if self.excitation_at == "velocity reference":
            if self.velocity is None:
                raise ConfigError(
                    "incomplete",
                    "loop.excitation_at = 'velocity reference' needs loop.velocity",
                    "describe the velocity controller",
                    key="loop.velocity",
                )
            return self.entry_gain * PID(**self.velocity.model_dump())
        feedback = self._feedback()
        if feedback is None:
            raise ConfigError(
                "incomplete",
                "loop.excitation_at = 'output' needs the loop's controllers",
                "describe loop.velocity",
                key="loop.velocity",
            )
        return Gain(-self.entry_gain) * feedback


class RecordSection(_Section):
    """[record]: the run is recorded in segments that survive a kill, also if the section is empty.

    Parameters
    ----------
    samples
        Also record the raw samples of the channels in use.
    budget_bytes
        Maximum size of the record in bytes: the oldest segments are removed, events never. Default: no limit.
    segment_s
        Machine time in one segment, in seconds.
    """

    samples: bool = False
    budget_bytes: Annotated[int, Field(ge=BUDGET_BYTES_MIN)] | None = None
    segment_s: Annotated[float, Field(gt=0, le=86400)] = 300.0


class ServeSection(_Section):
    """[serve]: address of the dashboard (`livebode run --serve`), and access to it.

    Parameters
    ----------
    address
        Address to listen on. Any other than the loopback needs a token and TLS.
    port
        TCP port; 0 selects a free port. `--port` overrides it.
    names
        Host names by which a browser may open the page, in addition to IP addresses and localhost.
    token_env
        Environment variable with the token of users who may acknowledge.
    token_file
        File with the token of users who may acknowledge, relative to this file.
    viewer_token_env
        Environment variable with the token of users who may only view.
    viewer_token_file
        File with the token of users who may only view, relative to this file.
    certificate_file
        Certificate for TLS in PEM, relative to this file.
    key_file
        Private key for TLS in PEM, relative to this file.
    read_only
        Nobody may acknowledge.
    language
        Language of the page; the choice of a user overrides it. Default: that of the browser.
    """

    address: str = "127.0.0.1"
    port: Annotated[int, Field(ge=0, le=65535)] = 8765
    names: list[str] = []
    token_env: str | None = None
    token_file: File | None = None
    viewer_token_env: str | None = None
    viewer_token_file: File | None = None
    certificate_file: File | None = None
    key_file: File | None = None
    read_only: bool = False
    language: Language | None = None

    def beside(self, folder: Path) -> ServeSection:
        """With files relative to a folder."""
        files = {name: path for name, path in self if name.endswith("_file") and path is not None}
        return self.model_copy(update={name: folder / path for name, path in files.items()})


class FitSection(_Section):
    """[fit]: with this section a model is fitted to every response.

    Parameters
    ----------
    model
        The model. "auto": two-mass if the input is a torque or radius_m is given, otherwise two-mass-gain; that also
        where a unit is recognised and not SI (rpm, mN m).
    output
        What the output is. "auto": by its kind, velocity if it has neither a unit nor a kind.
    side
        Where the output is measured. Default: motor.
    radius_m
        Radius of a belt's pulley in metres: the load is then a mass in kg, without it an inertia in kg m².
    inertia_ratio
        Load inertia divided by motor inertia, if known.
    fixed
        Parameters with a fixed value, such as { Js = 0.0028 }, in the unit of the parameter.
    free
        Additional parameters to fit, such as ["delay", "BL"].
    band_hz
        Lowest and highest frequency of the lines that are fitted, in Hz. Default: all lines.
    hold
        Hold of the sampled plant; "none" for the response of a plant without a sampling hold.
    """

    model: str = "auto"
    output: Literal["auto", "velocity", "position"] = "auto"
    side: Literal["motor", "load"] | None = None
    radius_m: Positive | None = None
    inertia_ratio: Positive | None = None
    fixed: dict[str, float] = {}
    free: list[str] = []
    band_hz: Annotated[list[float], Field(min_length=2, max_length=2)] | None = None
    hold: Literal["zero-order", "none"] = "zero-order"


class Axis(_Section):
    """One machine: its source, signals, lines, tracking and loop.

    Parameters
    ----------
    source
        The recording, or the live source.
    signals
        Names of the channels.
    lines
        The excited frequencies and the window.
    tracking
        How responses and their bounds are estimated.
    loop
        The controllers, the injection point of the excitation, and the times at which signals are logged.
    record
        The run is recorded in segments that survive a kill.
    motion
        The effect of the axis's motion is removed from the responses.
    fit
        A model is fitted to every response.
    output_only
        The modes are tracked from the output alone.
    monitoring
        Comparison with a baseline.
    serve
        Address of the dashboard, and access to it.
    report
        The first page of the report, and the limits that the machine must meet.
    machine
        Which machine it is.
    """

    source: SourceSettings
    signals: SignalsSection
    lines: LinesSection = LinesSection()
    tracking: TrackingSection = TrackingSection()
    loop: LoopSection = LoopSection()
    record: RecordSection | None = None
    motion: MotionSection | None = None
    fit: FitSection | None = None
    output_only: OutputOnlySection | None = None
    monitoring: MonitoringSection = MonitoringSection()
    serve: ServeSection = ServeSection()
    report: ReportSection | None = None
    machine: MachineSection | None = None

    @classmethod
    def read(cls, path: Path) -> Axis:
        """The Axis in a TOML file.

        Raises
        ------
        ConfigError
            If the file cannot be read, is not TOML, or has an unknown key or a value out of range; the message gives
            the key, the value and what is allowed.
        SourceError
            If the address of the source is invalid.
        """
        return cls.of(read_table(path), str(path)).beside(path.parent)

    @classmethod
    def of(cls, data: dict[str, Any], origin: str) -> Axis:
        """The Axis in plain data; `origin` names it in messages."""
        try:
            axis = cls.model_validate(data)
        except ValidationError as error:
            raise _first_of(error).at(origin) from None
        if sum(named is not None for named in (axis.source.log, axis.source.url, axis.source.replay)) != 1:
            raise ConfigError(
                "key-conflict",
                "[source] needs either a log, a url or a replay",
                "set source.log for a recording, source.url for a live source, or source.replay for a recorded one",
                key="source",
            ).at(origin)
        if len(axis.source.logs) > 1 and (keys := _of_one_recording(axis)):
            raise ConfigError(
                "key-conflict",
                f"{keys[0]} does not apply to several recordings in one run",
                "omit it, or track each recording in a run of its own",
                keys=["source.log", keys[0]],
            ).at(origin)
        if axis.source.url is not None:
            checked_address(axis.source.url, axis.source)
        if axis.source.replay is not None:
            check_keys(axis.source, "replay")
        if axis.output_only is not None:
            check_output_only(axis, origin)
        return axis

    @property
    def ready(self) -> ReadyCondition | None:
        """At which samples the machine is ready; None without such a channel. ConfigError as `ready_condition`."""
        of, averages = self.monitoring, self.tracking.average
        return ready_condition(self.signals.ready, of.ready_mask, of.ready_value, averages=averages)

    def beside(self, folder: Path) -> Axis:
        """The same with relative paths from `folder`."""
        axis = self.model_copy(update={"source": self.source.beside(folder), "serve": self.serve.beside(folder)})
        if self.report is not None:
            axis = axis.model_copy(update={"report": self.report.beside(folder)})
        baseline = axis.monitoring.baseline
        if baseline is None:
            return axis
        monitoring = axis.monitoring.model_copy(update={"baseline": folder / baseline})
        return axis.model_copy(update={"monitoring": monitoring})


class _ServeOnly(_Section):
    """A file with nothing but [serve]."""

    serve: ServeSection


def serve_section(path: Path) -> ServeSection:
    """[serve] of a configuration, or of a file that has only this section, as `livebode view` needs it.

    Raises
    ------
    ConfigError
        As of `Axis.read`.
    """
    data = read_table(path)
    if set(data) != {"serve"}:
        return Axis.of(data, str(path)).beside(path.parent).serve
    try:
        return _ServeOnly.model_validate(data).serve.beside(path.parent)
    except ValidationError as error:
        raise _first_of(error).at(str(path)) from None


def _of_one_recording(axis: Axis) -> list[str]:
    """Keys that are set and need a single recording."""
    given = {
        "source.follow": axis.source.follow,
        "[record] (option --continue)": axis.record is not None,
        "[motion]": axis.motion is not None,
        "[output_only] (option --output-only)": axis.output_only is not None,
        "monitoring.baseline": axis.monitoring.baseline is not None,
        f"tracking.estimator {axis.tracking.estimator!r}": axis.tracking.estimator in ("lpm", "welch"),
    }
    return [key for key, there in given.items() if there]


def _first_of(error: ValidationError) -> ConfigError:
    """The first error, with its key and value; missing keys last, because a misspelt key also causes a missing one."""
    first = min(error.errors(include_url=False), key=lambda one: one["type"] == "missing")
    if first["loc"][:1] == ("report",):
        return report_error(first)
    # After a union, pydantic adds the name of the type that it tried.
    place = one_line(".".join(str(part) for part in first["loc"] if part != "int" and "[" not in str(part)))
    if first["type"] == "extra_forbidden":
        return ConfigError("key-unknown", f"there is no setting {place!r}", nearest(first["loc"]), key=place)
    if first["type"] == "missing":
        return ConfigError("key-missing", f"{place!r} is missing", "add it", key=place)
    secret = MAY_BE_SECRET & {str(part) for part in first["loc"]}
    value = "its value" if secret else shortened(first["input"])
    why = first["msg"].removeprefix("Value error, ").lower()
    facts = {"key": place} | ({} if secret else {"value": value})
    return ConfigError("value-invalid", f"{place} = {value} is not usable: {why}", "correct it", **facts)


def nearest(loc: tuple[int | str, ...]) -> str:
    """Suggestion for an unknown key at this place of an axis."""
    section: Any = Axis
    for part in loc[:-1]:
        annotation = section.model_fields[part].annotation
        section = next(
            c
            for c in (annotation, *getattr(annotation, "__args__", ()))
            if isinstance(c, type) and issubclass(c, BaseModel)
        )
    names = [field.alias or name for name, field in section.model_fields.items()]
    return nearest_name(str(loc[-1]), names, "Settings")
