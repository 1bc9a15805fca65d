from typing import Any, Literal

import numpy as np
import numpy.typing as npt

Phase = Literal["window", "fixed"]

def read_rows(
    powers: npt.NDArray[np.uint64],
    layout: tuple[Any, ...],
    text: bytes,
    begin: int,
    out: npt.NDArray[np.float64],
    filled: int,
    /,
) -> tuple[int, int]: ...
def write_rows(
    powers: npt.NDArray[np.uint64],
    columns: tuple[Any, ...],
    words: tuple[bytes, bytes, npt.NDArray[np.int64]],
    out: npt.NDArray[np.uint8],
    /,
) -> int: ...
def decode_runs(data: bytes | memoryview, width: int, out: npt.NDArray[np.uint32], /) -> bool: ...
def best_instruction_set() -> int: ...
def process_lines(
    settings: tuple[Any, ...], moments: tuple[Any, ...], windows: tuple[Any, ...], out: tuple[Any, ...], /
) -> float: ...
def process_matrices(
    stage: tuple[Any, ...], history: tuple[Any, ...], windows: tuple[Any, ...], out: tuple[Any, ...], /
) -> None: ...
def largest_sizes(
    samples: npt.NDArray[np.float64], begun: int, window: int, instruction_set: int, out: npt.NDArray[np.float64], /
) -> None: ...
def periods_typical(
    periods: npt.NDArray[np.float64], instruction_set: int, out: npt.NDArray[np.float64], /
) -> None: ...
def periods_levels(
    periods: npt.NDArray[np.float64],
    less: npt.NDArray[np.float64] | None,
    instruction_set: int,
    out: npt.NDArray[np.float64],
    /,
) -> None: ...
def periods_straighten(
    periods: npt.NDArray[np.float64], drift: tuple[Any, ...], instruction_set: int, out: npt.NDArray[np.float64], /
) -> None: ...
def periods_reach(
    periods: npt.NDArray[np.float64],
    typical: npt.NDArray[np.float64],
    instruction_set: int,
    far: npt.NDArray[np.float64],
    size: npt.NDArray[np.float64],
    /,
) -> None: ...
def fit(
    model: tuple[Any, ...],
    frequency_hz: npt.NDArray[np.float64],
    rate_hz: float,
    rows: tuple[Any, ...],
    out: tuple[Any, ...],
    /,
) -> None: ...
def fit_epsilon(
    residual: npt.NDArray[np.float64],
    noise: npt.NDArray[np.float64],
    size: npt.NDArray[np.float64],
    dof: npt.NDArray[np.float64],
    out: npt.NDArray[np.float64],
    /,
) -> None: ...
def fit_response(
    model: tuple[Any, ...],
    rate_hz: float,
    values: npt.NDArray[np.float64],
    frequency_hz: npt.NDArray[np.float64],
    is_shared: bool,
    out: npt.NDArray[np.complex128],
    /,
) -> None: ...
def fit_margins(
    model: tuple[Any, ...],
    feedback: tuple[Any, ...],
    grid: tuple[Any, ...],
    values: npt.NDArray[np.float64],
    covariance: npt.NDArray[np.float64],
    out: tuple[Any, ...],
    /,
) -> None: ...
def belt_replay(
    masses: tuple[Any, ...],
    course: tuple[Any, ...],
    out: tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]],
    /,
) -> None: ...
def curve_at(shape: tuple[Any, ...], x: npt.NDArray[np.float64], out: npt.NDArray[np.float64], /) -> None: ...
def curve_splines(
    knots: npt.NDArray[np.float64], x: npt.NDArray[np.float64], out: npt.NDArray[np.float64], /
) -> None: ...
def belt_response(
    grid: tuple[Any, ...], parameters: npt.NDArray[np.float64], out: npt.NDArray[np.complex128], /
) -> None: ...
def belt_each(
    grid: tuple[Any, ...],
    rows: tuple[Any, ...],
    parameters: npt.NDArray[np.float64],
    out: tuple[Any, ...],
    /,
) -> None: ...
def belt_together(
    grid: tuple[Any, ...],
    rows: tuple[Any, ...],
    splines: tuple[Any, ...],
    unknowns: npt.NDArray[np.float64],
    out: tuple[Any, ...],
    /,
) -> None: ...
def judge_periods(
    plan: RepeatingPlan, state: tuple[Any, ...], periods: tuple[Any, ...], out: tuple[Any, ...], /
) -> tuple[float, float]: ...

class RepeatingPlan:
    def __init__(self, settings: tuple[Any, ...], /) -> None: ...

def process_newest(
    settings: tuple[Any, ...],
    machines: list[Any],
    largest: npt.NDArray[np.float64],
    place: npt.NDArray[np.int64],
    sums: npt.NDArray[np.complex128],
    chosen: tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]],
    moment: npt.NDArray[np.float64],
    factor: float,
    out: tuple[Any, ...],
    taken: npt.NDArray[np.bool_],
    /,
) -> int: ...
def largest_magnitudes(spectrum: npt.NDArray[np.complex128], out: npt.NDArray[np.float64], /) -> None: ...

class Engine:
    def __init__(
        self,
        window: int,
        bins: list[int],
        channels: int,
        is_double: bool,
        variant: int,
        damping: float,
        instruction_set: int,
        hop: int,
        /,
    ) -> None: ...
    @property
    def window(self) -> int: ...
    @property
    def channels(self) -> int: ...
    @property
    def count(self) -> int: ...
    def _instruction_set(self) -> int: ...
    def push(self, x: npt.ArrayLike, /) -> None: ...
    def process(
        self,
        x: npt.ArrayLike,
        hop: int | None = None,
        out: npt.NDArray[np.complexfloating[Any, Any]] | None = None,
        phase: Phase = "window",
    ) -> npt.NDArray[np.complexfloating[Any, Any]]: ...
    def advance(self, x: npt.ArrayLike, /) -> None: ...
    def spectrum(self, phase: Phase = "window") -> npt.NDArray[np.complexfloating[Any, Any]]: ...
    def snapshot(self) -> bytes: ...
    def restore(self, snapshot: bytes, /) -> None: ...
    def reset(self) -> None: ...
