from typing import Any, Literal

import numpy as np
import numpy.typing as npt

Phase = Literal["window", "fixed"]

def best_instruction_set() -> int: ...
def add_windows(
    moments: tuple[Any, ...],
    forgetting: float,
    table: npt.NDArray[np.float64],
    place: int,
    spectra: npt.NDArray[np.complex128],
    powers: npt.NDArray[np.float64],
    usable: npt.NDArray[np.bool_],
    out: tuple[Any, ...],
    /,
) -> None: ...
def process_lines(
    settings: tuple[Any, ...], moments: tuple[Any, ...], windows: tuple[Any, ...], out: tuple[Any, ...], /
) -> float: ...
def process_each(
    settings: tuple[Any, ...],
    moments: list[Any],
    largest: npt.NDArray[np.float64],
    place: npt.NDArray[np.int64],
    spectrum: npt.NDArray[np.complex128],
    moment: npt.NDArray[np.float64],
    out: tuple[Any, ...],
    /,
) -> None: ...

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
        hop: int = 1,
        out: npt.NDArray[np.complexfloating[Any, Any]] | None = None,
        phase: Phase = "window",
    ) -> npt.NDArray[np.complexfloating[Any, Any]]: ...
    def advance(self, x: npt.ArrayLike, /) -> None: ...
    def spectrum(self, phase: Phase = "window") -> npt.NDArray[np.complexfloating[Any, Any]]: ...
    def snapshot(self) -> bytes: ...
    def restore(self, snapshot: bytes, /) -> None: ...
    def reset(self) -> None: ...
