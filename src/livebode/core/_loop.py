"""Loop: the feedback, the injection point of the excitation, and when the signals were logged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex
from livebode.core.errors import UsageError
from livebode.core.model import Model, as_model

Logged = Literal["before", "after"]


@dataclass(frozen=True)
class Loop:
    """The closed loop u = E·w − F·y around the plant y = G·u, as recorded.

    Parameters
    ----------
    feedback
        F, from the measured output to the plant input with the sign of negative feedback: a Model, a
        python-control system or a number; None where it is not known.
    entry
        E, how the excitation reaches the plant input: 1 for one that is added to the torque reference, the
        velocity controller for one that is added to the velocity reference, −F for one added to the measured
        output.
    input_logged, excitation_logged, output_logged
        Whether each signal was logged before or after the tick's controller update. A drive reads y, computes u
        from it and applies it: the normal record has y before and u and w after the update. A u logged before the
        update is that of the previous tick; if this is not specified, the error is 10 % near a resonance.

    Raises
    ------
    TypeError
        If the feedback or the entry has no frequency response.
    UsageError
        If one of them has several inputs or outputs, or a `logged` word is not supported.

    Examples
    --------
    The loop of a drive: P position control around PI velocity control, and an excitation that is added to the torque.

    >>> from livebode import PID, Cascade
    >>> velocity = PID(gain=0.2308, integral_time_s=0.2, rate_hz=4000)
    >>> loop = Loop(feedback=Cascade(velocity=velocity, position=PID(gain=1.0, rate_hz=2000, rate_divider=2)))
    >>> loop.feedback_at([20.0, 140.0]).shape
    (2,)
    """

    feedback: Model | None = None
    entry: Model | None = None
    input_logged: Logged = "after"
    excitation_logged: Logged = "after"
    output_logged: Logged = "before"

    def __post_init__(self) -> None:
        for name in ("feedback", "entry"):
            if (given := getattr(self, name)) is not None:
                object.__setattr__(self, name, as_model(given))
        for name in ("input_logged", "excitation_logged", "output_logged"):
            if (word := getattr(self, name)) not in ("before", "after"):
                raise UsageError(
                    "not-one-of",
                    f"{name}={word!r} is not supported",
                    "choose 'before' or 'after' (the controller's update)",
                    argument=name,
                    value=word,
                    allowed=["before", "after"],
                )

    def advance_ticks(self, role: Literal["input", "excitation", "output"]) -> int:
        """Ticks by which the signal's spectrum is advanced, so that all spectra refer to the same tick."""
        late = {"input": "before", "excitation": "before", "output": "after"}[role]
        if getattr(self, f"{role}_logged") != late:
            return 0
        return -1 if role == "output" else 1

    def feedback_at(self, frequency_hz: ArrayLike) -> Complex:
        """F at these frequencies; UsageError where the Loop has no description of its feedback."""
        if self.feedback is None:
            raise UsageError(
                "missing",
                "the loop's feedback is missing",
                "describe its controllers, or use the joint estimator",
                argument="feedback",
            )
        return self.feedback.response(frequency_hz)

    def entry_at(self, frequency_hz: ArrayLike) -> Complex:
        """E at these frequencies."""
        if self.entry is None:
            return np.ones(np.shape(frequency_hz), dtype=np.complex128)
        return self.entry.response(frequency_hz)

    def plant(self, closed_loop: Complex, frequency_hz: ArrayLike) -> tuple[Complex, Complex]:
        """G = Gcl/(E − Gcl·F) from Gcl = Y/W, and its derivative dG/dGcl (Nevaranta 2016, eqs. (15), (16))."""
        entry, feedback = self.entry_at(frequency_hz), self.feedback_at(frequency_hz)
        denominator = entry - closed_loop * feedback
        return closed_loop / denominator, entry / denominator**2
