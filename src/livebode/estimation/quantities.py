"""Plant, open loop, closed loop and sensitivity from the same lines."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import Loop, Quantity


def convert(quantity: Quantity, plant: Complex, feedback: Complex) -> tuple[Complex, Complex]:
    """The quantity from plant G and feedback F, and its derivative by G.

    Open loop L = F·G, sensitivity S = 1/(1 + L), closed loop T = L/(1 + L), all at the plant input, where the
    excitation enters: L is the response of the loop cut there.

    Returns
    -------
    value, derivative
        Shape of `plant`; sigma of the quantity is |derivative|·sigma of the plant to first order.

    Examples
    --------
    >>> value, slope = convert("closed loop", np.array([1 + 0j]), np.array([1 + 0j]))
    >>> value, slope
    (array([0.5+0.j]), array([0.25+0.j]))
    """
    if quantity == "plant":
        return plant, np.ones_like(plant)
    open_loop = feedback * plant
    if quantity == "open loop":
        return open_loop, np.broadcast_to(feedback, plant.shape)
    sensitivity = 1 / (1 + open_loop)
    if quantity == "sensitivity":
        return sensitivity, -feedback * sensitivity**2
    return open_loop * sensitivity, feedback * sensitivity**2


def from_plant(
    quantity: Quantity, plant: Complex, loop: Loop, signals: tuple[Complex, Complex, Complex], frequency_hz: Floats
) -> tuple[Complex, Complex]:
    """The quantity from plant G, and its derivative by G; the feedback is that of the loop, or of the signals.

    Without a description of the controller the signals contain its action, F·y = E·w − u. `signals` are output, input
    and excitation, each correlated with the excitation.
    """
    if loop.feedback is not None:
        return convert(quantity, plant, loop.feedback_at(frequency_hz))
    output, input_, excitation = signals
    return convert(quantity, plant, (loop.entry_at(frequency_hz) * excitation - input_) / output)
