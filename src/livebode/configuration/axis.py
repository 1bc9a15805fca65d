"""Axis: configuration of one machine as plain data, read from TOML and validated completely before the start."""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from livebode.configuration.toml_file import one_line, read_table, shortened
from livebode.core import PID, Cascade, ConfigError, Gain, Loop, Model, PositionPD, Quantity, counted, nearest_name
from livebode.language import available
from livebode.sources.live import SourceSettings, checked_address

SAME_RATE = 1e-6
BUDGET_BYTES_MIN = 16 << 20
MAY_BE_SECRET = {
    *("url", "username", "password_env", "password_file"),
    *("token_env", "token_file", "viewer_token_env", "viewer_token_file"),
}
Ticks = Annotated[int, Field(ge=0)]
File = Annotated[Path, Field(strict=False)]


def _known_language(code: str) -> str:
    if code not in available():
        raise ValueError(f"is not one of the languages {', '.join(available())}")
    return code


Language = Annotated[str, AfterValidator(_known_language)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class SignalsSection(_Section):
    """[signals]: channel names."""

    output: str
    input: str | None = None
    excitation: str | None = None
    schedule: str | None = None


class LinesSection(_Section):
    """[lines]: frequencies as in `Lines.parse`, or "auto"; the window in samples, or "auto"."""

    frequencies: str = "auto"
    window: int | Literal["auto"] = "auto"


class TrackingSection(_Section):
    """[tracking]: options of `livebode.estimation.Settings`, and whether the roles of the channels are accepted."""

    estimator: Literal["direct", "joint", "indirect"] = "joint"
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


class MotionSection(_Section):
    """[motion]: removes the effect of the axis's motion from responses; see `livebode.motion.MotionCorrection`."""

    radius_m: Positive
    chunk_s: Positive = 4.0
    driven_by: Literal["torque", "excitation"] = "torque"


class MonitoringSection(_Section):
    """[monitoring]: the baseline, the mean time between false alarms in days of judged motion, and the channels that a
    baseline's parameters may depend on."""

    baseline: File | None = None
    covariates: Annotated[list[str], Field(max_length=4)] = []
    false_alarm_interval_days: Positive = 30.0


class _ControllerSection(_Section):
    rate_hz: Positive
    held_ticks: Annotated[int, Field(ge=1)] = 1
    hold: Literal["zero-order", "none"] = "zero-order"
    delay_ticks: Ticks = 0


class PIDSection(_ControllerSection):
    """[loop.velocity] and [loop.position]: see `livebode.core.PID`."""

    gain: float
    integral_time_s: Annotated[float, Field(gt=0)] = inf
    derivative_time_s: Annotated[float, Field(ge=0)] = 0.0
    derivative_filter_s: Annotated[float, Field(ge=0)] = 0.0
    integrator: Literal["backward", "forward", "trapezoidal", "continuous"] = "backward"


class PositionPDSection(_ControllerSection):
    """[loop.position_pd]: see `livebode.core.PositionPD`."""

    position_gain: float
    velocity_gain: float
    smoothed: bool = False


class LoopSection(_Section):
    """[loop]: the controllers, the injection point of the excitation, and the times at which signals are logged."""

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
            if part is not None and abs(part.rate_hz * part.held_ticks / rate_hz - 1) > SAME_RATE:
                held = counted(part.held_ticks, "tick")
                raise ConfigError(
                    "rate-mismatch",
                    f"loop.{name} has a rate of {part.rate_hz:g} Hz and holds {held}, which gives "
                    f"{part.rate_hz * part.held_ticks:g} Hz, but the sampling rate is {rate_hz:g} Hz",
                    "set held_ticks to the sampling rate divided by the rate of the controller",
                    key=f"loop.{name}",
                    rate_hz=rate_hz,
                    controller_rate_hz=part.rate_hz,
                    held_ticks=part.held_ticks,
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
    """[record]: the run is recorded in segments that survive a kill (docs/reference/run-directory.md)."""

    samples: bool = False
    budget_bytes: Annotated[int, Field(ge=BUDGET_BYTES_MIN)] | None = None
    segment_s: Annotated[float, Field(gt=0, le=86400)] = 300.0


class ServeSection(_Section):
    """[serve]: address of `livebode run --serve`, and access to it (docs/how-to/dashboard.md)."""

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
    """[fit]: the model that is fitted to every response; see `livebode.fitting.Fitter`."""

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
    """One machine: its source, signals, lines, tracking and loop."""

    source: SourceSettings
    signals: SignalsSection
    lines: LinesSection = LinesSection()
    tracking: TrackingSection = TrackingSection()
    loop: LoopSection = LoopSection()
    record: RecordSection | None = None
    motion: MotionSection | None = None
    fit: FitSection | None = None
    monitoring: MonitoringSection = MonitoringSection()
    serve: ServeSection = ServeSection()

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
        if (axis.source.log is None) == (axis.source.url is None):
            raise ConfigError(
                "key-conflict",
                "[source] needs either a log or a url",
                "set source.log for a recording, or source.url for a live source",
                key="source",
            ).at(origin)
        if axis.source.url is not None:
            checked_address(axis.source.url, axis.source)
        return axis

    def beside(self, folder: Path) -> Axis:
        """The same with relative paths from `folder`."""
        axis = self.model_copy(update={"source": self.source.beside(folder), "serve": self.serve.beside(folder)})
        baseline = axis.monitoring.baseline
        if baseline is None:
            return axis
        monitoring = axis.monitoring.model_copy(update={"baseline": folder / baseline})
        return axis.model_copy(update={"monitoring": monitoring})


def _first_of(error: ValidationError) -> ConfigError:
    """The first error, with its key and value; missing keys last, because a misspelt key also causes a missing one."""
    first = min(error.errors(include_url=False), key=lambda one: one["type"] == "missing")
    # After a union, pydantic adds the name of the type that it tried.
    place = one_line(".".join(str(part) for part in first["loc"] if part != "int" and "[" not in str(part)))
    if first["type"] == "extra_forbidden":
        return ConfigError("key-unknown", f"there is no setting {place!r}", nearest(first["loc"]), key=place)
    if first["type"] == "missing":
        return ConfigError("key-missing", f"{place!r} is missing", "add it", key=place)
    secret = MAY_BE_SECRET & {str(part) for part in first["loc"]}
    value = "its value" if secret else shortened(first["input"])
    facts = {"key": place} | ({} if secret else {"value": value})
    return ConfigError(
        "value-invalid", f"{place} = {value} is not usable: {first['msg'].lower()}", "correct it", **facts
    )


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
    return nearest_name(str(loc[-1]), section.model_fields, "Settings")
