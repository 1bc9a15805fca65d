"""The three estimators of the plant, each a quotient of two spectra that are correlated with a third."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Role = Literal["excitation", "input", "output"]


@dataclass(frozen=True)
class Estimator:
    """The quotient S_ry/S_rd of the output y and a denominator d, both correlated with a reference r.

    Over windows i the estimate is Σ Y_i·conj(R_i) / Σ D_i·conj(R_i).
    """

    name: str
    reference: Role
    denominator: Role
    through_loop: bool = False

    @property
    def roles(self) -> tuple[Role, ...]:
        """The signals that it needs, each once; the output is first."""
        return tuple(dict.fromkeys(("output", self.denominator, self.reference)))


DIRECT = Estimator("direct", reference="input", denominator="input")
"""G = S_uy/S_uu, Nevaranta 2016, eq. (1). Biased in closed loop: feedback correlates u with the noise. Unbiased
without feedback, and for a closed-loop response whose input is the reference."""

JOINT = Estimator("joint", reference="excitation", denominator="input")
"""G = S_wy/S_wu, Nevaranta 2016, eq. (2). Unbiased in closed loop, whatever the controller does; w is the
instrument."""

INDIRECT = Estimator("indirect", reference="excitation", denominator="excitation", through_loop=True)
"""G = Gcl/(E − Gcl·F) with Gcl = S_wy/S_ww, Nevaranta 2016, eqs. (15) and (16). Needs no u, but the controllers F;
biased by every error in their description (one forgotten tick of delay is 10 % near the resonance)."""

NON_PERIODIC = ("lpm", "welch")
"""Estimators for any excitation: the local polynomial method and Welch's method. Joint where an excitation is named,
else direct; see `NonPeriodicTracker`."""

ESTIMATORS = {estimator.name: estimator for estimator in (DIRECT, JOINT, INDIRECT)}
