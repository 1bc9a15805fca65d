from typing import Any

import numpy as np
import numpy.typing as npt

class Engine:
    def __init__(self, settings: dict[str, Any], position_m: float) -> None: ...
    @property
    def plant(self) -> list[float]: ...
    def advance(self, input: npt.NDArray[np.float64], output: npt.NDArray[np.float64]) -> int: ...
    def derivative(self, now: list[float], torque_n_m: float, state: list[float]) -> list[float]: ...

def two_masses(
    rate_hz: float,
    radius_m: float,
    pairs: npt.NDArray[np.float64],
    stiffness: npt.NDArray[np.float64],
    damping: npt.NDArray[np.float64],
    torque: npt.NDArray[np.float64],
    motor: npt.NDArray[np.float64],
    cart: npt.NDArray[np.float64],
) -> None: ...
def late(rows: npt.NDArray[np.float64], samples: float, out: npt.NDArray[np.float64]) -> None: ...
