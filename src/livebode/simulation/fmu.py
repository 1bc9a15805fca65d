"""A user's own plant as an FMU (FMI 2 or 3, co-simulation) under the drive's cascade, as a source of Blocks.

Sensor and control are in plain Python; tests compare them with simulation/axis.c, bit by bit.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import field
from math import copysign, floor, inf, isfinite, sin
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from livebode.arrays import Floats
from livebode.core import Block, Channel, SimulationError, UsageError, nearest_name, not_installed, remove_created
from livebode.dataclass import dataclass
from livebode.simulation.axis_settings import Drive, Limits, Sensor
from livebode.simulation.configuration import controller_settings
from livebode.simulation.delivery import CHANNELS, checked_block_samples, delivered, diverged, excitation_at
from livebode.simulation.motion import Motion, Standstill
from livebode.simulation.values import positive

Settings = Mapping[str, Any]


class Now(NamedTuple):
    """Inputs of one tick: references, excitation, noise, and the machine's condition."""

    position_reference: float
    velocity_reference: float
    w: float
    noise: float
    stiffness: float
    damping: float
    load_kg: float
    gap_m: float
    friction: float
    disturbance_n_m: float


class Controller:
    """Sensor and control of the drive (Nevaranta 2016, Fig. 7)."""

    def __init__(self, settings: Settings, angle: float) -> None:
        self.settings = settings
        self.integral: float = 0.0
        self.held: float = 0.0
        self.control: float = 0.0
        self.delayed = [0.0] * settings["delay_ticks"]
        self.limited = False
        self.angle, self.reading, self.tick_number = angle, self._encoder(angle), 0

    def tick(self, angle: float, velocity: float, now: Now) -> tuple[float, float, float]:
        """Torque, velocity and angle as logged at this tick."""
        velocity = self._read(angle, velocity) + now.noise
        torque = self._update(velocity, now) + now.w
        most = self.settings["torque_n_m_max"]
        self.limited = abs(torque) > most
        self.tick_number += 1
        return (copysign(most, torque) if self.limited else torque), velocity, self.reading

    def _encoder(self, angle: float) -> float:
        step, eccentricity = self.settings["encoder_step_rad"], self.settings["encoder_eccentricity_rad"]
        if eccentricity > 0 and isfinite(angle):
            angle += eccentricity * sin(angle)
        return floor(angle / step + 0.5) * step if step > 0 and isfinite(angle) else angle

    def _read(self, angle: float, velocity: float) -> float:
        reading, rate = self._encoder(angle), self.settings["rate_hz"]
        if self.settings["velocity_differenced"]:
            velocity = (reading - self.reading) * rate
        else:
            velocity = velocity + ((reading - angle) - (self.reading - self.angle)) * rate
        self.reading, self.angle = reading, angle
        return velocity

    def _update(self, velocity: float, now: Now) -> float:
        s, n = self.settings, self.tick_number
        if n % s["position_ticks"] == 0:
            self.held = s["position_gain_per_s"] * (now.position_reference - self.reading) + (
                s["velocity_feedforward"] * now.velocity_reference
            )
        if n % s["velocity_ticks"] == 0:
            error = self.held - velocity
            if not self.limited:
                self.integral += error * s["integral_step"]
            self.control = s["velocity_gain_n_m_s"] * (error + self.integral)
        if not self.delayed:
            return self.control
        slot = n % len(self.delayed)
        torque, self.delayed[slot] = self.delayed[slot], self.control
        return torque


_NO_FAULT = (1.0, 1.0, 1.0, 0.0, 1.0, 0.0)  # the FMU has its own


@dataclass(frozen=True, kw_only=True, eq=False)
class FmuAxis:
    """Drive and motion as in a BeltAxis around the user's own plant; needs the extra ``fmu`` (fmpy).

    At every tick the FMU's angle and velocity are read, the controllers updated, the torque set, and one step of a
    tick computed. The FMU starts with its own start values, and the motion begins there. There is no truth, and
    stability is not checked in advance; a value that is not finite stops the run with a SimulationError ("diverged").

    Parameters
    ----------
    path
        The FMU: FMI 2 or 3 with co-simulation for this platform. It is native code with this process's rights.
    torque, velocity, position
        Names of its input, N m, and its outputs, rad/s and rad.
    cart
        Name of an output for the channel x, m; None takes `radius_m` times the position.
    radius_m
        Turns the motion's metres into the motor's angle.
    drive, sensor, limits, motion, excitation_n_m, seconds, seed
        As in BeltAxis.

    Raises
    ------
    LivebodeError
        If fmpy is missing, the file is not such an FMU, a name is not one of its variables, or the motion exceeds its
        limits.
    """

    path: Path | str
    torque: str = "torque"
    velocity: str = "velocity"
    position: str = "position"
    cart: str | None = None
    radius_m: float = 0.019
    drive: Drive = field(default_factory=Drive)
    sensor: Sensor = field(default_factory=Sensor)
    limits: Limits = field(default_factory=Limits)
    motion: Motion = field(default_factory=Standstill)
    excitation_n_m: Floats = field(default_factory=lambda: np.zeros(0))
    seconds: float = inf
    seed: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "excitation_n_m", np.array(self.excitation_n_m, dtype=np.float64))
        positive(self, "radius_m")
        if not self.seconds > 0:
            raise UsageError(
                "out-of-range",
                f"seconds={self.seconds} is not above 0",
                "leave it out for a run without end",
                argument="seconds",
                value=self.seconds,
            )
        if self.excitation_n_m.ndim != 1 or not np.all(np.isfinite(self.excitation_n_m)):
            raise UsageError(
                "wrong-shape",
                "excitation_n_m is not one period of finite numbers, N m",
                "specify one period, shape (samples,)",
                argument="excitation_n_m",
                shape=list(self.excitation_n_m.shape),
            )
        for name in ("torque_ripple_n_m", "torque_noise_n_m"):
            if value := getattr(self.drive, name):
                raise UsageError(
                    "conflict",
                    f"{name}={value}, but an FMU has its own disturbances",
                    "set it to 0",
                    argument=name,
                    value=value,
                )
        self.motion.check(self.limits)
        self._references()

    @property
    def channels(self) -> tuple[Channel, ...]:
        return CHANNELS

    @property
    def rate_hz(self) -> float:
        return self.drive.rate_hz

    @property
    def samples(self) -> int | None:
        """Samples of the run; None without end."""
        return None if self.seconds == inf else round(self.seconds * self.rate_hz)

    def blocks(
        self,
        channels: Sequence[str] | None = None,
        block_samples: int = 4096,
        *,
        real_time: bool = False,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], object] = time.sleep,
    ) -> Iterator[Block]:
        """The samples from the first to the last, from a fresh instance of the FMU."""
        checked_block_samples(block_samples)
        return delivered(self._blocks(block_samples), channels, real_time, clock, sleep)

    def _references(self) -> list[int]:
        """Value references of torque, angle, velocity and, where there is one, the cart."""
        known = {v.name: v.valueReference for v in _description(self.path).modelVariables}
        names = [self.torque, self.position, self.velocity, *([] if self.cart is None else [self.cart])]
        for name in names:
            if name not in known:
                raise UsageError(
                    "unknown-name",
                    f"there is no channel {name!r}",
                    nearest_name(name, known),
                    value=name,
                    allowed=list(known),
                    path=str(self.path),
                )
        return [known[name] for name in names]

    def _blocks(self, block_samples: int) -> Iterator[Block]:
        entry, *exits = self._references()
        plant = _Instance(self.path, entry, exits)
        try:
            yield from self._run(plant, block_samples)
        finally:
            plant.close()

    def _run(self, plant: _Instance, block_samples: int) -> Iterator[Block]:
        position, speed = (row / self.radius_m for row in self.motion.cycle(self.rate_hz))
        position = position - position[0] + plant.read()[0]
        noise = np.random.default_rng(self.seed)
        controller = Controller(controller_settings(self.drive, self.sensor), plant.read()[0])
        start = 0
        while self.samples is None or start < self.samples:
            ticks = block_samples if self.samples is None else min(block_samples, self.samples - start)
            number = np.arange(start, start + ticks)
            w = excitation_at(self.excitation_n_m, number)
            references = [row[number % row.size] for row in (position, speed)]
            disturbed = self.sensor.noise_rad_per_s * noise.standard_normal(ticks)
            rows = np.array([*references, w, disturbed])
            logged = [self._tick(plant, controller, column, start + i) for i, column in enumerate(rows.T.tolist())]
            data = np.vstack([w, np.array(logged).T, references])
            yield Block(data, CHANNELS, self.rate_hz, start=start)
            start += ticks

    def _tick(
        self, plant: _Instance, controller: Controller, given: list[float], number: int
    ) -> tuple[float, float, float, float]:
        values = plant.read()
        if not all(isfinite(value) for value in values):
            raise diverged(number / self.rate_hz, values, "an output of the FMU is not finite")
        now = Now._make([*given, *_NO_FAULT])
        torque, velocity, reading = controller.tick(values[0], values[1], now)
        plant.step(torque, number / self.rate_hz, 1 / self.rate_hz)
        return torque, velocity, reading, values[2] if self.cart is not None else values[0] * self.radius_m


class _Instance:
    """One instance of an FMU: FMI 2 and 3 behind the same three verbs."""

    def __init__(self, path: Path | str, entry: int, exits: list[int]) -> None:
        fmpy = _fmpy()
        description = _description(path)
        self._entry, self._exits = [entry], exits
        self._folder = fmpy.extract(str(path))
        try:
            self._fmu = fmpy.simulation.instantiate_fmu(self._folder, description, "CoSimulation")
        except Exception as error:
            remove_created(Path(self._folder))
            raise SimulationError(
                "fmu-unusable",
                f"{path} cannot be started: {error}",
                "try it in another simulator",
                path=str(path),
                reason=str(error),
            ) from error
        third = description.fmiVersion.startswith("3")
        self._set = self._fmu.setFloat64 if third else self._fmu.setReal
        self._get = self._fmu.getFloat64 if third else self._fmu.getReal
        if not third:
            self._fmu.setupExperiment(startTime=0.0)
        self._fmu.enterInitializationMode()
        self._fmu.exitInitializationMode()

    def read(self) -> list[float]:
        """Angle, velocity and, where there is one, the cart."""
        return [float(value) for value in self._get(self._exits)]

    def step(self, torque: float, time_s: float, tick_s: float) -> None:
        self._set(self._entry, [torque])
        self._fmu.doStep(currentCommunicationPoint=time_s, communicationStepSize=tick_s)

    def close(self) -> None:
        with suppress(Exception):
            self._fmu.terminate()
        self._fmu.freeInstance()
        remove_created(Path(self._folder))


def _fmpy() -> Any:
    try:
        import fmpy
        import fmpy.simulation
    except ImportError as error:
        raise not_installed("FMUs need fmpy, which is not installed", extra="fmu", package="fmpy") from error
    return fmpy


def _description(path: Path | str) -> Any:
    """The model description of an FMU that can be simulated here; SimulationError otherwise."""
    fmpy = _fmpy()
    try:
        description = fmpy.read_model_description(str(path))
        platforms = fmpy.supported_platforms(str(path))
    except Exception as error:
        raise SimulationError(
            "fmu-unusable",
            f"{path} cannot be read as an FMU: {error}",
            "export it again",
            path=str(path),
            reason=str(error),
        ) from error
    if description.coSimulation is None or not description.fmiVersion.startswith(("2", "3")):
        raise SimulationError(
            "fmu-unusable",
            f"{path} has FMI {description.fmiVersion} without co-simulation",
            "export it for FMI 2 or 3 with co-simulation",
            path=str(path),
            fmi_version=description.fmiVersion,
        )
    if fmpy.platform not in platforms and fmpy.platform_tuple not in platforms:
        raise SimulationError(
            "fmu-unusable",
            f"{path} has binaries for {', '.join(platforms)}, not for {fmpy.platform}",
            "export it for this platform",
            path=str(path),
            platforms=list(platforms),
            platform=fmpy.platform,
        )
    return description
