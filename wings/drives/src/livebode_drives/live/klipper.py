"""Klipper: accelerometer and commanded motion of a 3D printer, through the socket of its API server.

After docs/API_Server.md of Klipper: JSON objects, each ended by the character 0x03; adxl345/dump_adxl345 and
motion_report/dump_trapq (the queue of moves with constant acceleration) are subscribed to.
"""

from __future__ import annotations

import json
import socket
from collections import deque
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import ConfigError, LivebodeError, SourceError
from livebode.sources.live import (
    TICK_S,
    Address,
    Batch,
    LiveSource,
    Position,
    Reach,
    named_channels,
    pieces,
)
from livebode_drives.live.on_grid import OnGrid
from livebode_drives.source_settings import DriveKeys

MOVES_MAX = 1 << 16
"""Moves that wait for the samples of their time."""
MOVE_FIELDS = ("time", "duration", "start_velocity", "acceleration", "start_position", "direction")
SIDE = 3
"""Periods on each side of a time from which its acceleration is computed."""
_SECOND_DERIVATIVE = (1 / 90, -3 / 20, 3 / 2, -49 / 18, 3 / 2, -3 / 20, 1 / 90)
_AXES = 3


class Moves:
    """Moves in the order of their times; between them the machine stands."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Begin again."""
        self._moves = np.empty((0, 4 + _AXES))  # start, duration, velocity, acceleration, direction
        self._newest_s = -np.inf
        self.known_s = -np.inf
        """Print time up to which all moves are known."""

    def add(self, rows: object) -> float:
        """Add moves, as in `data` of Klipper's message; the print time at which the first new one begins.

        Raises
        ------
        SourceError
            If they are not moves.
        """
        moves = _checked(rows)
        moves = moves[moves[:, 0] > self._newest_s]
        if not len(moves):
            return np.inf
        self._moves = np.concatenate([self._moves, moves])[-MOVES_MAX:]
        self._newest_s = float(moves[-1, 0])
        self.known_s = float(moves[-1, 0] + moves[-1, 1])
        return float(moves[0, 0])

    def acceleration(self, first: int, numbers: int, rate_hz: float) -> Floats:
        """Commanded acceleration at so many multiples of a period, shape (3, numbers), in mm/s².

        It is the second derivative of the commanded position at seven multiples. The acceleration itself jumps, and
        samples of it would contain what is above half the rate; the position is smooth. At 1/16 of the rate the error
        is 3·10⁻⁴ of what the moves contain there.
        """
        times_s = np.asarray(np.arange(first - SIDE, first + numbers + SIDE) / rate_hz, dtype=np.float64)
        position = self._displacement(times_s)
        total = np.zeros((_AXES, numbers))
        for shift, weight in enumerate(_SECOND_DERIVATIVE):
            total += weight * position[:, shift : shift + numbers]
        return total * rate_hz**2

    def forget(self, time_s: float) -> None:
        """Drop the moves that ended before this print time."""
        self._moves = self._moves[self._moves[:, 0] + self._moves[:, 1] >= time_s]

    def _displacement(self, time_s: Floats) -> Floats:
        """Displacement since the oldest move, shape (3, times), in mm."""
        moves = self._moves
        if not len(moves):
            return np.zeros((_AXES, time_s.size))
        duration_s, speed, acceleration, direction = moves[:, 1], moves[:, 2], moves[:, 3], moves[:, 4:]
        paths = (speed * duration_s + 0.5 * acceleration * duration_s**2)[:, None] * direction
        before = np.concatenate([np.zeros((1, _AXES)), np.cumsum(paths, axis=0)])
        index = np.searchsorted(moves[:, 0], time_s, side="right") - 1
        move = np.maximum(index, 0)
        since_s = np.where(index >= 0, np.minimum(time_s - moves[move, 0], duration_s[move]), 0.0)
        path = speed[move] * since_s + 0.5 * acceleration[move] * since_s**2
        return np.asarray((before[move] + path[:, None] * direction[move]).T)


def _checked(rows: object) -> Floats:
    try:
        moves = np.array([[*row[:4], *row[5]] for row in rows], dtype=np.float64)  # type: ignore[attr-defined]
    except (TypeError, ValueError, LookupError, OverflowError):
        raise not_moves() from None
    if moves.size == 0:
        return np.empty((0, 4 + _AXES))
    if moves.ndim != 2 or moves.shape[1] != 4 + _AXES or not np.isfinite(moves).all():
        raise not_moves()
    if (moves[:, 1] < 0).any() or (np.diff(moves[:, 0]) < 0).any():
        raise not_moves()
    return moves


def not_moves() -> SourceError:
    return SourceError(
        "value-invalid",
        f"a message of Klipper's motion_report/dump_trapq has no rows of {', '.join(MOVE_FIELDS)} in order",
        "check the version of Klipper",
        key="data",
    )


END = b"\x03"
MESSAGE_BYTES_MAX = 8 << 20
RATE_HZ = 3200.0
CHANNELS = tuple(f"{name}_{axis} [mm/s^2]" for name in ("command", "accel") for axis in "xyz")
FIELDS = ("time", "x_acceleration", "y_acceleration", "z_acceleration")
WAIT_S = 3.0
"""How long samples wait for the moves of their time, which Klipper sends after they ended, every half second."""
_CHIPS = ("adxl345", "lis2dw", "lis3dh", "mpu9250", "icm20948", "bmi160")


class KlipperSource(LiveSource):
    """The printer behind the socket in the URL. Samples are numbered by print time: the microcontroller's clock."""

    settings: DriveKeys
    format: ClassVar[str] = "klipper"
    waits: ClassVar[bool] = True

    def __init__(self, settings: DriveKeys, address: Address) -> None:
        super().__init__(settings, address)
        self._chip, _, name = settings.accelerometer.partition(" ")
        if self._chip not in _CHIPS:
            raise ConfigError(
                "value-invalid",
                f"source.accelerometer = {settings.accelerometer!r} is not a section of an accelerometer",
                f"give its section in printer.cfg, such as {_CHIPS[0]!r} or '{_CHIPS[0]} bed'",
                key="source.accelerometer",
                value=settings.accelerometer,
            )
        self._name = name or self._chip
        self._rate_given = settings.rate_hz or RATE_HZ
        self._channels = named_channels(list(CHANNELS))
        self._grid, self._moves = OnGrid(self._rate_given, 3), Moves()
        self._waiting: deque[tuple[int, NDArray[np.float64]]] = deque()
        self._passed_s = self._newest_s = -np.inf
        self._overflows = self._epoch = 0

    def resume(self, position: Position) -> None:
        super().resume(position)
        self._epoch = position.epoch

    def reach(self) -> Reach:
        return Reach.by(self._linked, self.address)

    def _linked(self) -> None:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as link:
            link.connect(str(Path(self.address.path).expanduser()))

    def _receive(self) -> bool:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as link:
            link.settimeout(TICK_S)
            link.connect(str(Path(self.address.path).expanduser()))
            self._begin()
            link.sendall(self._requests())
            buffer = bytearray()
            for piece in pieces(link, self._stop, "Klipper"):
                buffer += piece
                *messages, remainder = buffer.split(END)
                buffer = bytearray(remainder)
                if len(buffer) > MESSAGE_BYTES_MAX:
                    raise ConnectionError(f"a message is longer than {MESSAGE_BYTES_MAX} bytes")
                for message in messages:
                    self._process_message(bytes(message))
        return False

    def _begin(self) -> None:
        self._grid.restart()
        self._moves.clear()
        self._waiting.clear()
        self._overflows = 0
        self._answered: set[int] = set()

    def _requests(self) -> bytes:
        calls = (
            (f"{self._chip}/dump_{self._chip}", {"sensor": self._name}),
            ("motion_report/dump_trapq", {"name": "toolhead"}),
        )
        return b"".join(
            json.dumps({"id": id_, "method": method, "params": {**params, "response_template": {"of": id_}}}).encode()
            + END
            for id_, (method, params) in enumerate(calls)
        )

    def _process_message(self, message: bytes) -> None:
        try:
            fields = json.loads(message)
            if not isinstance(fields, dict):
                raise ValueError
        except (ValueError, RecursionError):
            self._malformed(f"{len(message)} bytes are not a JSON object")
            return
        if "id" in fields:
            self._process_answer(fields)
            return
        params = fields.get("params")
        if not isinstance(params, dict):
            self._malformed("a message has no params")
            return
        try:
            if fields.get("of") == 0:
                self._process_samples(params)
            elif fields.get("of") == 1:
                self._process_moves(params)
        except LivebodeError as error:
            if error.code == "source.refused":
                raise
            self._malformed(error)

    def _process_answer(self, fields: dict[str, Any]) -> None:
        """The answer to a subscription; ConnectionError if it is refused, since Klipper may still be starting."""
        if "error" in fields:
            error = fields["error"]
            text = error.get("message") if isinstance(error, dict) else error
            raise ConnectionError(f"Klipper rejects the request: {ascii(text)[:200]}")
        result, expected = fields.get("result"), FIELDS if fields["id"] == 0 else MOVE_FIELDS
        header = result.get("header") if isinstance(result, dict) else None
        if not isinstance(header, list) or tuple(header[: len(expected)]) != expected:
            raise ConnectionError(f"Klipper sends {ascii(header)[:200]} instead of {', '.join(expected)}")
        self._answered.add(int(fields["id"]))
        if len(self._answered) == 2:
            self._established()

    def _process_samples(self, params: dict[str, Any]) -> None:
        rows = _samples(params.get("data"))
        overflows = params.get("overflows", 0)
        if overflows != self._overflows:
            self._overflows = overflows
            self._grid.restart()
            self._malformed(
                f"the accelerometer's buffer overflowed ({ascii(overflows)[:20]} times since it was started)"
            )
        if not rows.size:
            return
        if rows[0, 0] < self._newest_s - 1.0:
            self._restarted()
        rows = rows[rows[:, 0] > self._newest_s]
        if not len(rows):
            return
        self._newest_s = float(rows[-1, 0])
        self._waiting += self._grid.process(rows[:, 0], rows[:, 1:].T)
        self._check_rate()
        self._pass_on()

    def _restarted(self) -> None:
        """Print time went back: the microcontroller was started again."""
        self._epoch += 1
        self._begin()
        self._grid = OnGrid(self._rate_given, 3)
        self._passed_s = self._newest_s = -np.inf

    def _check_rate(self) -> None:
        step_s = self._grid.step_s
        if step_s is not None and not 0.5 <= self._rate_given * step_s <= 2.0:
            raise SourceError(
                "refused",
                f"source.rate_hz is {self._rate_given:g}, but the accelerometer samples at {1 / step_s:.4g} Hz",
                "set it to a rate from half to twice this one, of which the period of the excitation is a multiple",
                rate_hz=self._rate_given,
            )

    def _process_moves(self, params: dict[str, Any]) -> None:
        begins_s = self._moves.add(params.get("data"))
        if begins_s < self._passed_s:
            self._malformed(
                f"a move came {self._passed_s - begins_s:.2g} s after samples of its time were passed on without it: "
                f"a move or the delay of Klipper is longer than {WAIT_S:g} s"
            )
        self._pass_on()

    def _pass_on(self) -> None:
        """Deliver the samples whose moves are known."""
        certain_s = max(self._moves.known_s, self._newest_s - WAIT_S)
        while self._waiting:
            first, values = self._waiting[0]
            known = min(values.shape[1], int(np.floor(certain_s * self._rate_given)) - SIDE - first + 1)
            if known <= 0:
                break
            self._waiting.popleft()
            if known < values.shape[1]:
                self._waiting.appendleft((first + known, values[:, known:]))
            command = self._moves.acceleration(first, known, self._rate_given)
            data = np.concatenate([command, values[:, :known]])
            self._passed_s = (first + known) / self._rate_given
            self._moves.forget(self._passed_s - SIDE / self._rate_given)
            self._deliver(Batch(first, data, self._channels, self._rate_given, self._epoch))


def _samples(rows: object) -> NDArray[np.float64]:
    """Rows of time and three accelerations, shape (samples, 4); SourceError if they are not."""
    try:
        samples = np.array(rows, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        samples = np.zeros(1)
    if samples.size == 0:
        return np.empty((0, 4))
    good = samples.ndim == 2 and samples.shape[1] == len(FIELDS) and np.isfinite(samples).all()
    if not good or (np.diff(samples[:, 0]) <= 0).any() or not 0 <= samples[0, 0] <= samples[-1, 0] < 1e9:
        raise SourceError(
            "value-invalid",
            f"a message of the accelerometer has no rows of {', '.join(FIELDS)} in order",
            "check the version of Klipper",
            key="data",
        )
    return samples
